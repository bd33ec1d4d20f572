#include "master/diagnose/places/where.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kLevel = 0.01;  // greatest corrected p of a row
constexpr std::size_t kMostRows = 12;
constexpr double kOutlierSds = 3.2905;  // square root of the 0.999 quantile of chi2, 1 dof
constexpr double kOutlierShare = 0.001;
constexpr std::size_t kFewestShown = 8;
constexpr double kClearMotion = 5;    // s.d.s of the end by which a unit gain must move it
constexpr int kMostDependences = 12;  // dependences taken out of one component
const char* const kComponents[] = {"x", "y", "theta"};

// One component of one selection of trials.
struct Selection {
  std::string command;
  int component = 0;
  bool along_motion = false;  // signs turned so that positive is too much motion
  std::vector<std::size_t> trials;
  std::vector<double> sign;
};

class Looker {
 public:
  Looker(std::span<const ResidualTrial> trials, std::span<const Eigen::Vector3d> residuals,
         std::span<const Eigen::Matrix3d> covariances, std::span<const Cell> cells,
         const WhereForm& form)
      : form_(form),
        trials_(trials),
        residuals_(residuals),
        covariances_(covariances),
        cells_(cells),
        left_(residuals.begin(), residuals.end()),
        spent_(residuals.size(), Eigen::Vector3d::Zero()) {
    double squares = 0;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      for (int k = 0; k < 3; ++k) squares += std::pow(residuals[i][k] / sd(i, k), 2);
    }
    const auto n = static_cast<double>(trials.size());
    excess_ = std::max(squares - 3 * n, std::sqrt(6 * n));
    covariates_ = form.covariates(trials, residuals, cells);
    for (WhereCovariate* mean : {&mean_, &mean_of_motion_}) {
      mean->columns.setOnes(static_cast<Eigen::Index>(trials.size()), 1);
    }
    mean_of_motion_.with_motion = true;
  }

  std::vector<Where> look(const Problem& problem) {
    std::vector<std::vector<Selection>> selections;
    for (int k = 0; k < 3; ++k) selections.push_back(selections_of(k, problem));
    for (const auto& component : selections) {
      for (const Selection& s : component) looks_ += covariates_.size() + (s.along_motion ? 1 : 3);
    }
    for (const auto& component : selections) {
      look_for_means(component);
      look_at_scatter(component);
    }
    return std::move(rows_);
  }

 private:
  std::string deviation(const Selection& s, double size, bool trend) const {
    return form_.deviation(s.component, size, s.along_motion, trend);
  }
  double sd(std::size_t trial, int k) const { return std::sqrt(covariances_[trial](k, k)); }
  double path(std::size_t trial) const { return cells_[trials_[trial].cell].path; }

  std::vector<Selection> selections_of(int k, const Problem& problem) const {
    Selection all{"all", k, false, {}, {}};
    Selection motion{"all", k, true, {}, {}};
    std::map<std::size_t, Selection> commands;
    for (std::size_t i = 0; i < trials_.size(); ++i) {
      const std::size_t c = trials_[i].command;
      Selection& own =
          commands.try_emplace(c, Selection{problem.commands[c].name, k, false, {}, {}})
              .first->second;
      for (Selection* s : {&all, &own}) {
        s->trials.push_back(i);
        s->sign.push_back(1);
      }
      const double moved = (trials_[i].left + trials_[i].right)[k];
      if (std::abs(moved) < kClearMotion * sd(i, k)) continue;
      motion.trials.push_back(i);
      motion.sign.push_back(moved > 0 ? 1 : -1);
    }
    std::vector<Selection> some;
    if (commands.size() > 1) some = {all, motion};
    for (const auto& [c, own] : commands) some.push_back(own);
    std::erase_if(some, [](const Selection& s) { return s.trials.size() < kFewestShown; });
    return some;
  }

  // The clearest dependence of the component is reported and taken out, then the next clearest.
  void look_for_means(const std::vector<Selection>& selections) {
    for (int round = 0; round < kMostDependences; ++round) {
      std::optional<Found> best;
      for (const Selection& s : selections) {
        const View v = view(s);
        const auto offer = [&](const WhereCovariate& covariate, const std::vector<int>& groups) {
          TrendTest test = trend_test(v.u, columns_of(covariate, s), v.scale, groups);
          if (test.dimensions == 0) return;
          const bool clearer = !best || test.p < best->test.p ||
                               (test.p == best->test.p && test.squares > best->test.squares);
          if (clearer) best = Found{&s, &covariate, std::move(test)};
        };
        offer(s.along_motion ? mean_of_motion_ : mean_, std::vector<int>(s.trials.size(), -1));
        for (const WhereCovariate& c : covariates_) {
          offer(c, c.within_cells ? v.groups : v.commands);
        }
      }
      if (!best || corrected(best->test.p) > kLevel) return;
      report(*best);
      const Selection& s = *best->selection;
      // With the part that the cells' means took: covariates are centred over all trials.
      const Eigen::VectorXd fitted = columns_of(*best->covariate, s) * best->test.coefficients;
      for (std::size_t i = 0; i < s.trials.size(); ++i) {
        left_[s.trials[i]][s.component] -= s.sign[i] * fitted[i];
        spent_[s.trials[i]][s.component] += best->test.dimensions / double(s.trials.size());
      }
    }
  }

  struct View {
    Eigen::VectorXd u, scale;
    std::vector<int> commands, groups;
  };
  struct Found {
    const Selection* selection = nullptr;
    const WhereCovariate* covariate = nullptr;
    TrendTest test;
  };

  View view(const Selection& s) const {
    const auto n = static_cast<Eigen::Index>(s.trials.size());
    View v{Eigen::VectorXd(n), Eigen::VectorXd(n), {}, {}};
    std::set<int> seen;
    for (std::size_t i = 0; i < s.trials.size(); ++i) {
      const std::size_t trial = s.trials[i];
      v.scale[i] = sd(trial, s.component);
      v.u[i] = s.sign[i] * left_[trial][s.component] / v.scale[i];
      v.commands.push_back(static_cast<int>(trials_[trial].command));
      v.groups.push_back(static_cast<int>(trials_[trial].cell));
      seen.insert(v.groups.back());
    }
    if (double(n) < kFewInCell * double(seen.size())) v.groups = v.commands;
    return v;
  }

  // Holm's step-down: the rows already reported are not looked at again.
  double corrected(double p) const {
    return std::min(1.0, p * double(looks_ - std::min(looks_ - 1, rows_.size())));
  }

  // What a dependence that grows with the motion is multiplied by: the motion itself where signs
  // are turned along it (m, m, rad for the whole of it), else the path.
  double motion(const Selection& s, std::size_t trial) const {
    const ResidualTrial& t = trials_[trial];
    return s.along_motion ? std::abs((t.left + t.right)[s.component]) : path(trial);
  }

  double mean_motion(const Selection& s) const {
    return sum_of(s.trials, [&](std::size_t i) { return motion(s, i); }) / double(s.trials.size());
  }

  Eigen::MatrixXd columns_of(const WhereCovariate& covariate, const Selection& s) const {
    Eigen::MatrixXd columns(s.trials.size(), covariate.columns.cols());
    for (std::size_t i = 0; i < s.trials.size(); ++i) {
      columns.row(i) = covariate.columns.row(s.trials[i]) *
                       (covariate.with_motion ? motion(s, s.trials[i]) : 1.0);
    }
    return columns;
  }

  void push(const Selection& s, const char* kind, const std::string& covariate, double size,
            double squares, double p, std::string text) {
    rows_.push_back({s.command, kComponents[s.component], kind, covariate, size,
                     std::clamp(squares / excess_, 0.0, 1.0), corrected(p), std::move(text)});
  }

  void report(const Found& found) {
    const auto& [selection, covariate, test] = found;
    const Selection& s = *selection;
    const double grown = covariate->with_motion ? mean_motion(s) : 1.0;
    const double slope = 1000 * test.coefficients[0] * covariate->unit * grown;
    std::string text = form_.motions(s.command) + " ";
    if (covariate->name.empty()) {
      push(s, "bias", "", std::abs(slope), test.squares - 1, test.p,
           text + deviation(s, slope, false) + " on average.");
      return;
    }
    const Eigen::VectorXd fitted = test.fitted.cwiseProduct(view(s).scale);
    const double size = 1000 * std::sqrt(fitted.squaredNorm() / double(fitted.size()));
    if (!covariate->each.empty()) {
      text += deviation(s, slope, true) + " " + covariate->each + ".";
    } else {
      text +=
          "differ in " + form_.component(s.component) + " by " + amount_text(size, s.component) +
          " (s.d.) with the " +
          (covariate->name == "previous residual" ? "error of the trial before" : covariate->name) +
          ".";
    }
    push(s, "trend", covariate->name, size, test.squares - test.dimensions, test.p, text);
  }

  // What is left about the means, apart from outliers.
  struct Scatter {
    Selection selection;
    double count = 0, freedom = 0, squares = 0, wild = 0, variance = 0;
    std::vector<double> beyond;  // sizes of the outliers, mm or mrad
    double p_spread = 1, p_outliers = 1;
  };

  Scatter scatter_of(const Selection& s) const {
    Scatter scatter;
    scatter.selection = s;
    const View v = view(s);
    scatter.count = double(s.trials.size());
    scatter.freedom =
        scatter.count - double(std::set<int>(v.groups.begin(), v.groups.end()).size());
    for (const std::size_t i : s.trials) scatter.freedom -= spent_[i][s.component];
    scatter.variance = 1e6 * v.scale.squaredNorm();
    // Outliers must not pull the means that they are judged by: they are put onto them.
    Eigen::VectorXd clean = v.u, left;
    double limit = 0;
    for (int round = 0; round < 4; ++round) {
      const Eigen::VectorXd means = group_means(clean, v.scale, v.groups);
      left = v.u - means;
      std::vector<double> sizes;
      for (const double value : left) sizes.push_back(std::abs(value));
      limit = kOutlierSds * std::max(1.0, median_deviation(sizes));
      for (Eigen::Index i = 0; i < left.size(); ++i) {
        clean[i] = std::abs(left[i]) > limit ? means[i] : v.u[i];
      }
    }
    for (Eigen::Index i = 0; i < left.size(); ++i) {
      if (std::abs(left[i]) > limit) {
        scatter.beyond.push_back(1000 * std::abs(left[i]) * v.scale[i]);
        scatter.wild += left[i] * left[i] - 1;
      } else {
        scatter.squares += left[i] * left[i];
      }
    }
    scatter.freedom -= double(scatter.beyond.size());
    return scatter;
  }

  static void judge(Scatter& s) {
    if (s.freedom < 4) return;
    s.p_spread = std::min(1.0, 2 * std::min(chi_squared_below(s.freedom, s.squares),
                                            chi_squared_above(s.freedom, s.squares)));
    if (s.beyond.empty()) return;
    s.p_outliers = binomial_above(s.count, kOutlierShare, double(s.beyond.size()) - 1);
  }

  // The commands one by one, and all of them pooled; all when most of them scatter so.
  void look_at_scatter(const std::vector<Selection>& selections) {
    std::vector<Scatter> single;
    Scatter pooled;
    for (const Selection& s : selections) {
      if (s.command == "all") {
        pooled.selection = s.along_motion ? pooled.selection : s;
        continue;
      }
      single.push_back(scatter_of(s));
      Scatter& one = single.back();
      judge(one);
      for (double Scatter::*sum : {&Scatter::count, &Scatter::freedom, &Scatter::squares,
                                   &Scatter::wild, &Scatter::variance}) {
        pooled.*sum += one.*sum;
      }
      append(pooled.beyond, one.beyond);
    }
    judge(pooled);
    const bool several = single.size() > 1;
    for (double Scatter::*p : {&Scatter::p_spread, &Scatter::p_outliers}) {
      const auto clear = [&](const Scatter& s) { return corrected(s.*p) <= kLevel; };
      const auto count = std::count_if(single.begin(), single.end(), clear);
      const bool most = 2 * static_cast<std::size_t>(count) > single.size();
      if (several && clear(pooled) && (most || count == 0)) {
        report_scatter(pooled, p == &Scatter::p_spread);
        continue;
      }
      for (const Scatter& s : single) {
        if (clear(s)) report_scatter(s, p == &Scatter::p_spread);
      }
    }
  }

  void report_scatter(const Scatter& scatter, bool spread) {
    const Selection& s = scatter.selection;
    const std::string what = form_.component(s.component);
    if (!spread) {
      const std::string of = std::to_string(std::lround(scatter.count));
      push(s, "outliers", "", median(scatter.beyond), scatter.wild, scatter.p_outliers,
           form_.motions(s.command) + ": " + std::to_string(scatter.beyond.size()) + " of " + of +
               " are far off in " + what + ", where " +
               plain_number(kOutlierShare * scatter.count) + " would be by chance.");
      return;
    }
    const double ratio = scatter.squares / scatter.freedom;
    const double size =
        std::sqrt(scatter.variance / scatter.count) * std::sqrt(std::abs(ratio - 1));
    push(s, "spread", "", size, scatter.squares - scatter.freedom, scatter.p_spread,
         form_.motions(s.command) + " scatter " + plain_number(std::sqrt(ratio)) +
             " times as much in " + what + " as the noise allows (" +
             amount_text(size, s.component) + (ratio > 1 ? " beyond it)." : " below it)."));
  }

  const WhereForm& form_;
  std::span<const ResidualTrial> trials_;
  std::span<const Eigen::Vector3d> residuals_;
  std::span<const Eigen::Matrix3d> covariances_;
  std::span<const Cell> cells_;
  double excess_ = 1;
  std::vector<WhereCovariate> covariates_;
  WhereCovariate mean_, mean_of_motion_;  // without a name: of nothing else
  std::vector<Eigen::Vector3d> left_;     // residuals without what was reported
  std::vector<Eigen::Vector3d> spent_;    // degrees of freedom that took
  std::size_t looks_ = 0;
  std::vector<Where> rows_;
};

}  // namespace

std::vector<Where> where(std::span<const ResidualTrial> trials,
                         std::span<const Eigen::Vector3d> residuals,
                         std::span<const Eigen::Matrix3d> covariances, std::span<const Cell> cells,
                         const Problem& problem, const WhereForm& form) {
  assert(trials.size() == residuals.size() && trials.size() == covariances.size());
  if (trials.empty()) return {};
  std::vector<Where> rows = Looker(trials, residuals, covariances, cells, form).look(problem);
  std::ranges::stable_sort(rows, std::greater(), &Where::share);
  if (rows.size() > kMostRows) rows.resize(kMostRows);
  return rows;
}

}  // namespace gapfarm
