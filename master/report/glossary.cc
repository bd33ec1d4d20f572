#include "master/report/glossary.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cassert>
#include <iterator>

#include "master/report/html.h"

namespace gapfarm {
namespace {

struct Entry {
  std::string_view id, name, text;
};

constexpr Entry kEntries[] = {
    {"nat", "nat a trial",
     "How much worse a model predicts where a trial ends, as the logarithm of the density that it "
     "gave to the measured pose. One nat less: the pose was thought e = 2.7 times less likely. 0.1 "
     "is hardly seen in a plot, 1 is."},
    {"gap", "gap",
     "What the simulation loses against the best that any model could do on this log: in nats a "
     "trial below the floor, or as root mean square in mm and mrad."},
    {"floor", "floor",
     "What repeating the same trial in reality varies by, readings included. No model gets below "
     "it but by luck. (Not the ground.)"},
    {"tuned", "tuned model",
     "The simulation with its own parameters (speed, contact, ...) fitted to this log, and no "
     "effect added."},
    {"final", "final model", "The tuned simulation with the named effects added, fitted together."},
    {"before", "before", "The simulation with the values of the config."},
    {"after", "after", "The simulation with the best values that evolution found."},
    {"held-out", "held out",
     "Trials that the fit did not see: each is predicted by a fit to the other sessions, or to "
     "other blocks of trials. A model cannot look better on them by learning them by heart."},
    {"interval", "90 % interval",
     "Were all trials made again and again, nine in ten such intervals would hold the true value, "
     "if the simulation is right otherwise."},
    {"bound", "searched between",
     "The least and greatest value that the search was allowed. A value at one of them wanted to "
     "go on: the model lacks something, or the range is too narrow."},
    {"correlation", "correlation",
     "From −1 to 1: how far a change of one parameter can be made up for by another. Near ±1 the "
     "log shows only a combination of the two."},
    {"rms", "rms",
     "Root mean square: the square root of the mean of the squared errors. A few far trials count "
     "a lot."},
    {"residual", "residual",
     "Measured minus predicted end pose: x along the predicted heading, y to its left, theta the "
     "heading, counter-clockwise."},
    {"trend", "trend, bias, spread",
     "How a residual depends on something. A bias is the same for all trials, a trend grows or "
     "turns with what it depends on, a spread scatters more (or less) than the model says. “theta "
     "trend” is a heading that does so."},
    {"share", "share of the gap", "How much of the gap this alone accounts for."},
    {"p", "p, corrected",
     "How often chance alone would show as much, of all that was looked at. Below 0.01: hardly "
     "chance."},
    {"gain", "gain",
     "By how many nats, over all trials together, the effect at its best strength explains the "
     "residuals better than retuning does. Below about 9 it is not distinguished from luck."},
    {"closed", "closes",
     "The share of the gap, in nats, that went away when the effect was added. mm and mrad, which "
     "include the floor, shrink less."},
    {"confidence", "confidence",
     "How sure it is that this effect, or one of its aliases, is there."},
    {"alias", "alias", "An effect that would explain these trials as well."},
    {"ellipse", "90 % ellipse", "Should hold nine trials in ten, if the model's spread is right."},
    {"telling", "a finding", "Marked ◆: the residuals depend on this, as the table above says."},
    {"generation", "generation",
     "One round of evolution: the individuals that the one before left are varied and evaluated."},
    {"operator", "operator",
     "A way to make a new individual of old ones: crossing two, or changing one by a little."},
    {"population", "last generation",
     "The middle nine tenths of the last generation's values. It is narrow where the search has "
     "settled, which does not mean that the data determine the value: `gapfarm determine` says "
     "that."},
    {"validation", "held out",
     "Trials of other files, named in the config, that evolution never saw."},
    {"baseline", "without a simulation",
     "Predictions that need no simulation: what the logged drives themselves did. A simulation "
     "should beat them."},
};

const Entry* find(std::string_view id) {
  const auto* found = std::find_if(std::begin(kEntries), std::end(kEntries),
                                   [&](const Entry& e) { return e.id == id; });
  return found == std::end(kEntries) ? nullptr : found;
}

}  // namespace

std::string term(std::string_view id, std::string_view shown) {
  assert(find(id) != nullptr);
  return fmt::format(R"(<a class="term" href="#term-{}">{}</a>)", id, html_escaped(shown));
}

std::string glossary_section(const std::vector<std::string_view>& ids) {
  std::string html = R"(<section id="words"><h2>Words</h2><dl class="glossary">)";
  for (const std::string_view id : ids) {
    const Entry* entry = find(id);
    assert(entry != nullptr);
    html += fmt::format(R"(<div id="term-{}"><dt>{}</dt><dd>{}</dd></div>)", id,
                        html_escaped(entry->name), html_escaped(entry->text));
  }
  return html + "</dl></section>\n";
}

const std::vector<std::string_view>& diagnosis_terms() {
  static const std::vector<std::string_view> ids = {
      "nat",   "gap",         "floor", "tuned",    "final",      "held-out", "interval",
      "bound", "correlation", "rms",   "residual", "ellipse",    "trend",    "share",
      "p",     "telling",     "gain",  "closed",   "confidence", "alias"};
  return ids;
}

const std::vector<std::string_view>& run_terms() {
  static const std::vector<std::string_view> ids = {
      "nat",   "before",     "after",    "generation", "population", "operator",
      "bound", "validation", "baseline", "rms",        "residual",   "ellipse"};
  return ids;
}

}  // namespace gapfarm
