#include "common/progress/overall_progress.h"

#include <algorithm>

#include "common/base/build_info.h"
#include "common/base/text.h"

namespace gapfarm {
namespace {

// Below this no time is estimated for the rest.
constexpr double kLeastPace_s = 0.5;

constexpr double kGrace_s = 1, kLocalGrace_s = 5;
constexpr double kPatience_s = 30;

}  // namespace

OverallProgress::OverallProgress(std::vector<ProgressStage> stages) : stages_(std::move(stages)) {
  for (const ProgressStage& stage : stages_) whole_ += stage.share;
}

void OverallProgress::begin(std::size_t k, double now_s, std::uint64_t tasks) {
  if (k >= stages_.size()) return;
  if (begun_ && k == stage_) {
    ProgressStage& stage = stages_[k];
    if (stage.tasks == 0) return;
    const double more = stage.share * static_cast<double>(tasks) / static_cast<double>(stage.tasks);
    stage.tasks += tasks;
    stage.share += more;
    whole_ += more;
    return;
  }
  if (!begun_) first_s_ = now_s;
  if (begun_ && k > stage_) {
    behind_ += stages_[stage_].share;
    behind_fresh_ += stages_[stage_].share * fresh_part();
    for (std::size_t i = stage_ + 1; i < k; ++i) behind_ += stages_[i].share;
  } else if (!begun_) {
    for (std::size_t i = 0; i < k; ++i) behind_ += stages_[i].share;
  }
  remembered_before_ += std::exchange(remembered_, 0);
  simulated_before_ += std::exchange(simulated_, 0);
  begun_ = true;
  stage_ = k;
  stage_s_ = now_s;
  if (tasks > 0) stages_[k].tasks = tasks;
}

bool OverallProgress::begin(const std::string& name, double now_s) {
  for (std::size_t k = 0; k < stages_.size(); ++k) {
    if (stages_[k].name != name) continue;
    begin(k, now_s);
    return true;
  }
  return false;
}

void OverallProgress::answered(std::uint64_t remembered, std::uint64_t simulated) {
  remembered_ = remembered;
  simulated_ = simulated;
}

void OverallProgress::expect(std::uint64_t tasks) {
  if (begun_) stages_[stage_].tasks = tasks;
}

// A stage that asks nothing takes its time all the same.
double OverallProgress::fresh_part() const {
  const std::uint64_t all = remembered_ + simulated_;
  return all == 0 ? 1 : static_cast<double>(simulated_) / static_cast<double>(all);
}

OverallProgress::Passed OverallProgress::present(double now_s) const {
  const ProgressStage& stage = stages_[stage_];
  const auto done = static_cast<double>(remembered_ + simulated_);
  if (stage.tasks > 0) {
    const double share = std::min(1.0, done / static_cast<double>(stage.tasks));
    return {share, share * fresh_part()};
  }
  // As the stages before had it; once this one takes longer than that, it is taken to be at its
  // end.  Where none was in work there is no pace to go by.
  if (behind_fresh_ <= 0) return {0, 0};
  const double in_stage = now_s - stage_s_, gone = now_s - first_s_;
  const double before = (gone - in_stage) / behind_fresh_;
  const double expected = std::max(before, gone / (behind_fresh_ + stage.share)) * stage.share;
  const double share = expected > 0 ? std::min(1.0, in_stage / expected) : 0;
  return {share, share * fresh_part()};
}

ProgressView OverallProgress::at(double now_s) const {
  ProgressView view;
  view.stages = stages_.size();
  if (!begun_ || whole_ <= 0) return view;
  const ProgressStage& stage = stages_[stage_];
  const Passed passed = present(now_s);
  view.stage = stage.name;
  view.number = stage_ + 1;
  view.done = remembered_ + simulated_;
  view.total = stage.tasks == 0 ? 0 : std::max(stage.tasks, view.done);
  view.remembered = remembered_before_ + remembered_;
  view.simulated = simulated_before_ + simulated_;
  const double done = behind_ + stage.share * passed.share;
  shown_ = std::max(shown_, std::min(1.0, done / whole_));
  view.share = shown_;
  const double gone = now_s - first_s_, in_stage = now_s - stage_s_;
  if (in_stage > 0) view.rate_per_s = static_cast<double>(simulated_) / in_stage;
  const double fresh = behind_fresh_ + stage.share * passed.fresh;
  if (gone < kLeastPace_s || fresh <= 0) return view;
  view.time_left_s = std::max(0.0, whole_ - done) * gone / fresh;
  return view;
}

std::string progress_line(const ProgressView& view) {
  std::string text;
  if (view.stages > 1 && view.number > 0) {
    text = "stage " + std::to_string(view.number) + " of " + std::to_string(view.stages) + ", ";
  }
  text += view.stage + ": ";
  if (view.total > 0) {
    text += std::to_string(view.done) + " of " + std::to_string(view.total) + ", ";
  }
  text += format_share(view.share) + " done";
  if (view.stages > 1 && view.total > 0) text += " in all";
  return progress_text(text, view.rate_per_s, view.time_left_s);
}

WorkerWait::WorkerWait(const std::vector<std::string>& endpoints) {
  for (const std::string& endpoint : endpoints) {
    where_ += (where_.empty() ? " at " : ", ") + endpoint;
    if (connect_.empty()) connect_ = reachable(endpoint, "THIS_HOST");
  }
}

std::optional<std::string> WorkerWait::message(std::size_t workers, double now_s) {
  if (workers > 0) {
    since_s_.reset();
    return std::nullopt;
  }
  if (!since_s_) since_s_ = now_s;
  const double waited_s = now_s - *since_s_;
  if (waited_s < (connect_.empty() ? kLocalGrace_s : kGrace_s)) return std::nullopt;
  std::string text = "waiting for " + std::string(connect_.empty() ? "local workers" : "workers") +
                     where_ + ", for " + format_duration(waited_s) + " now";
  if (waited_s >= kPatience_s) {
    text += connect_.empty() ? "; do they start?  See the lines above"
                             : "; start one with `gapfarm-worker --connect " + connect_ + "`";
  }
  return text;
}

}  // namespace gapfarm
