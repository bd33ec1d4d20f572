#include "master/ground/partial_result.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "master/ground/report/ground_verdict.h"
#include "master/ground/tolerances.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostOffersReported = 6;

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

void emit_faults(const GroundWork& work, const GroundSearch& search) {
  if (!work.on_finding) return;
  Finding finding;
  finding.about = "faults of the log";
  finding.text =
      search.faults.empty()
          ? "Nothing of the log is the wrong way round or in another unit."
          : "With this put right, the log is far closer to what the robot's file expects: " +
                things_of(search, search.faults) + ".";
  finding.text +=
      fmt::format(" {} windows of {} stretches are held against the robot's kinematics.",
                  search.windows.trials.size(), search.windows.blocks);
  work.on_finding(std::move(finding));
}

void emit_offers(const GroundWork& work, const GroundSearch& search,
                 const std::vector<std::pair<Offer, WindowFit>>& tried) {
  if (!work.on_finding) return;
  std::vector<const Offer*> best;
  for (const auto& [offer, fit] : tried) best.push_back(&offer);
  std::stable_sort(best.begin(), best.end(),
                   [](const Offer* a, const Offer* b) { return a->gain > b->gain; });
  // Most change nothing of what stands there.
  if (best.size() > kMostOffersReported &&
      best[kMostOffersReported - 1]->gain >= tried.back().first.gain &&
      tried.size() < to_try(search)) {
    return;
  }
  Finding finding;
  finding.about = "what the catalogue offers";
  finding.text = fmt::format("{} of {} values tried{}; one is named from {:g} nats on.",
                             tried.size(), to_try(search),
                             search.steps.empty() ? "" : " beside what is named", kLeastGroundGain);
  finding.columns = {"value", "would gain, nats"};
  for (std::size_t i = 0; i < std::min(best.size(), kMostOffersReported); ++i) {
    if (best[i]->gain <= 0) continue;
    finding.rows.emplace_back(search.catalogue[best[i]->hypothesis].thing,
                              nats_text(best[i]->gain));
  }
  work.on_finding(std::move(finding));
}

void emit_steps(const GroundWork& work, const GroundSearch& search) {
  if (!work.on_finding) return;
  Finding finding;
  finding.about = "what is named so far";
  finding.columns = {"value", "gains, nats"};
  for (const GroundStep& step : search.steps) {
    finding.rows.emplace_back(search.catalogue[step.chosen].thing, nats_text(step.gain));
  }
  finding.text = search.steps.empty() ? "Nothing of the catalogue is worth a name so far."
                                      : "Better on stretches that were held out, too:";
  for (const GroundStep& step : search.steps) {
    if (step.not_distinguished.empty()) continue;
    finding.text += " " + search.catalogue[step.chosen].thing + " is not distinguished from " +
                    things_of(search, step.not_distinguished) + ".";
  }
  work.on_finding(std::move(finding));
}

void emit_rest(const GroundWork& work, const GroundSearch& search) {
  if (!work.on_finding) return;
  Finding finding;
  finding.about = "what is left";
  GroundFigures figures;
  figures.closable = search.closable;
  figures.best_of_all = search.best_of_all;
  finding.text = verdict_reason(figures);
  work.on_finding(std::move(finding));
}

}  // namespace gapfarm
