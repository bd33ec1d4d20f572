#include "master/ground/so_far.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "master/ground/report/ground_verdict.h"
#include "master/ground/tolerances.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostOffersTold = 6;

std::string things_of(const GroundSearch& search, const std::vector<std::size_t>& hypotheses) {
  std::string text;
  for (const std::size_t h : hypotheses) {
    text += (text.empty() ? "" : ", ") + search.catalogue[h].thing;
  }
  return text;
}

// Faults of the log are looked for before.
std::size_t to_try(const GroundSearch& search) {
  return static_cast<std::size_t>(
      std::count_if(search.catalogue.begin(), search.catalogue.end(),
                    [](const GroundHypothesis& h) { return !h.put_right; }));
}

std::string nats_text(double nats) { return fmt::format("{:.1f}", nats); }

}  // namespace

void tell_of_faults(const GroundWork& work, const GroundSearch& search) {
  if (!work.on_finding) return;
  Finding told;
  told.about = "faults of the log";
  told.text =
      search.faults.empty()
          ? "Nothing of the log is the wrong way round or in another unit."
          : "With this put right, the log is far nearer to what the robot's file expects: " +
                things_of(search, search.faults) + ".";
  told.text += fmt::format(" {} windows of {} stretches are held against the robot's kinematics.",
                           search.windows.trials.size(), search.windows.blocks);
  work.on_finding(std::move(told));
}

void tell_of_offers(const GroundWork& work, const GroundSearch& search,
                    const std::vector<std::pair<Offer, WindowFit>>& tried) {
  if (!work.on_finding) return;
  std::vector<const Offer*> best;
  for (const auto& [offer, fit] : tried) best.push_back(&offer);
  std::stable_sort(best.begin(), best.end(),
                   [](const Offer* a, const Offer* b) { return a->gain > b->gain; });
  // Most change nothing of what stands there.
  if (best.size() > kMostOffersTold && best[kMostOffersTold - 1]->gain >= tried.back().first.gain &&
      tried.size() < to_try(search)) {
    return;
  }
  Finding told;
  told.about = "what the catalogue offers";
  told.text = fmt::format("{} of {} values tried{}; one is named from {:g} nats on.", tried.size(),
                          to_try(search), search.steps.empty() ? "" : " beside what is named",
                          kLeastGroundGain);
  told.columns = {"value", "would gain, nats"};
  for (std::size_t i = 0; i < std::min(best.size(), kMostOffersTold); ++i) {
    if (best[i]->gain <= 0) continue;
    told.rows.emplace_back(search.catalogue[best[i]->hypothesis].thing, nats_text(best[i]->gain));
  }
  work.on_finding(std::move(told));
}

void tell_of_steps(const GroundWork& work, const GroundSearch& search) {
  if (!work.on_finding) return;
  Finding told;
  told.about = "what is named so far";
  told.columns = {"value", "gains, nats"};
  for (const GroundStep& step : search.steps) {
    told.rows.emplace_back(search.catalogue[step.chosen].thing, nats_text(step.gain));
  }
  told.text = search.steps.empty() ? "Nothing of the catalogue is worth a name so far."
                                   : "Better on stretches that were left out, too:";
  for (const GroundStep& step : search.steps) {
    if (step.not_told_apart.empty()) continue;
    told.text += " " + search.catalogue[step.chosen].thing + " is not told from " +
                 things_of(search, step.not_told_apart) + ".";
  }
  work.on_finding(std::move(told));
}

void tell_of_rest(const GroundWork& work, const GroundSearch& search) {
  if (!work.on_finding) return;
  Finding told;
  told.about = "what is left";
  GroundFigures figures;
  figures.closable = search.closable;
  told.text = verdict_reason(figures);
  work.on_finding(std::move(told));
}

}  // namespace gapfarm
