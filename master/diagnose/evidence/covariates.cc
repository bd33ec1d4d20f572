#include "master/diagnose/evidence/covariates.h"

#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "master/diagnose/fit/free_commands.h"
#include "master/diagnose/fit/signatures.h"
#include "master/diagnose/fit/slopes.h"

namespace gapfarm {
namespace {

using Values = std::vector<double>;  // one a trial

class BlockBuilder {
 public:
  explicit BlockBuilder(const Study& study) : study_(study) {}

  Values values(const Feature& feature) const { return mapped(study_.trials, feature); }

  // The feature by how far the trial's command takes the robot.
  Values by_path(const Feature& feature) const {
    return values([&](const ResidualTrial& t) { return feature(t) * cell(t).path; });
  }

  const Cell& cell(const ResidualTrial& t) const { return study_.cells[t.cell]; }

  // Every feature in every group of trials and every component.
  CovariateBlock block(const std::string& name, const std::vector<Values>& features,
                       const std::vector<Values>& groups) const {
    std::vector<Eigen::VectorXd> columns;
    for (const Values& group : groups) {
      for (const Values& feature : features) {
        for (int k = 0; k < 3; ++k) {
          std::vector<Eigen::Vector3d> d(study_.size(), Eigen::Vector3d::Zero());
          for (std::size_t i = 0; i < d.size(); ++i) d[i][k] = group[i] * feature[i];
          columns.push_back(study_.whiten(d));
        }
      }
    }
    return {name, stack(columns)};
  }

  // Whatever is alike for trials with the same command, duties and duration.
  CovariateBlock cells() const {
    std::vector<Values> groups(study_.cells.size(), Values(study_.size(), 0));
    for (std::size_t i = 0; i < study_.size(); ++i) groups[study_.trials[i].cell][i] = 1;
    return block("command, level and duration", {Values(study_.size(), 1)}, groups);
  }

  // World-frame shifts of the readings that depend on the pose: end's less start's, seen from the
  // predicted end; a heading shift of the start turns the whole prediction.
  CovariateBlock readings() const {
    std::vector<PoseFeature> fields = powers_of_place(study_);
    for (int h = 1; h <= 3; ++h) {
      fields.push_back([=](const Pose& X) { return std::cos(h * X.theta); });
      fields.push_back([=](const Pose& X) { return std::sin(h * X.theta); });
    }
    std::vector<Eigen::VectorXd> columns;
    for (const PoseFeature& field : fields) {
      for (int k = 0; k < 3; ++k) columns.push_back(study_.whiten(reading_shift(field, k)));
    }
    return {"place of the readings", stack(columns)};
  }

 private:
  std::vector<Eigen::Vector3d> reading_shift(const PoseFeature& field, int component) const {
    std::vector<Eigen::Vector3d> d(study_.size(), Eigen::Vector3d::Zero());
    for (std::size_t i = 0; i < d.size(); ++i) {
      const ResidualTrial& t = study_.trials[i];
      const double start = field(t.X_WS);
      const double end = field(t.X_WP);
      const Eigen::Matrix3d to_end = rotation_about_z(-t.X_WP.theta);
      if (component == 2) {
        // The motion, turned by a quarter.
        const Eigen::Vector3d turned =
            to_end * Eigen::Vector3d(t.X_WS.y - t.X_WP.y, t.X_WP.x - t.X_WS.x, 1);
        d[i] = end * Eigen::Vector3d::UnitZ() - start * turned;
      } else {
        d[i] = to_end * ((end - start) * Eigen::Vector3d::Unit(component));
      }
    }
    return d;
  }

  const Study& study_;
};

// Of what was driven before.
std::vector<CovariateBlock> blocks_before(const Study& study, const BlockBuilder& b,
                                          const std::vector<Values>& commands) {
  std::vector<CovariateBlock> blocks;
  const std::vector<Values> same_or_against = {
      b.values([&](const ResidualTrial& t) {
        return b.cell(t).command.left * b.cell(t).command.right > 0 ? 1.0 : 0.0;
      }),
      b.values([&](const ResidualTrial& t) {
        return b.cell(t).command.left * b.cell(t).command.right < 0 ? 1.0 : 0.0;
      })};
  std::vector<Values> previous;
  for (std::size_t c = 1; c < commands.size(); ++c) {
    Values after = b.by_path([](const ResidualTrial&) { return 1.0; });
    for (std::size_t i = 0; i < study.size(); ++i) {
      const auto& before = study.trials[i].context.previous;
      if (!before || commands[c][*before] == 0) after[i] = 0;
    }
    previous.push_back(std::move(after));
  }
  if (!previous.empty()) blocks.push_back(b.block("command before", previous, same_or_against));
  const auto work = [&study](const ResidualTrial& t) {
    return t.context.previous ? study.cells[study.trials[*t.context.previous].cell].path : 0.0;
  };
  blocks.push_back(b.block("work before", {b.by_path(work)}, commands));
  return blocks;
}

}  // namespace

std::vector<Feature> start_place(const Study& study) {
  const Eigen::Vector2d middle = middle_of(study);
  const auto x = [=](const ResidualTrial& t) { return t.X_WS.x - middle.x(); };
  const auto y = [=](const ResidualTrial& t) { return t.X_WS.y - middle.y(); };
  return {x, y, [=](const ResidualTrial& t) { return x(t) * x(t); },
          [=](const ResidualTrial& t) { return x(t) * y(t); },
          [=](const ResidualTrial& t) { return y(t) * y(t); }};
}

std::vector<Feature> harmonics(const Feature& angle, int most) {
  std::vector<Feature> features;
  for (int h = 1; h <= most; ++h) {
    features.push_back([=](const ResidualTrial& t) { return std::cos(h * angle(t)); });
    features.push_back([=](const ResidualTrial& t) { return std::sin(h * angle(t)); });
  }
  return features;
}

std::vector<PoseFeature> powers_of_place(const Study& study) {
  const Eigen::Vector2d middle = middle_of(study);
  std::vector<PoseFeature> powers;
  for (int i = 0; i <= 3; ++i) {
    for (int j = 0; i + j <= 3; ++j) {
      if (i + j == 0) continue;
      powers.push_back([=](const Pose& X) {
        return std::pow(X.x - middle.x(), i) * std::pow(X.y - middle.y(), j);
      });
    }
  }
  return powers;
}

std::vector<CovariateBlock> covariate_blocks(const Study& study) {
  const BlockBuilder b(study);
  const auto scaled = [&](const Feature& f) { return b.by_path(f); };
  const auto turns = [&](Pose ResidualTrial::*X, int h) {
    return mapped(harmonics([=](const ResidualTrial& t) { return h * (t.*X).theta; }, 1), scaled);
  };
  const std::vector<Values> commands = drive_classes(study);
  double longest_s = 1;
  for (const ResidualTrial& t : study.trials) {
    longest_s = std::max(longest_s, t.context.session_time_s);
  }
  const auto time = [=](const ResidualTrial& t) {
    return t.context.session_time_s / longest_s - 0.5;
  };
  const auto reversed = [&](bool left) {
    return b.values([=, &b](const ResidualTrial& t) {
      const int last = left ? t.context.last_left : t.context.last_right;
      const double duty = left ? b.cell(t).command.left : b.cell(t).command.right;
      return last * duty < 0 ? 1.0 : 0.0;
    });
  };

  std::vector<CovariateBlock> blocks;
  blocks.push_back(study.free_commands ? free_command_block(study) : b.cells());
  blocks.push_back(b.block("start heading", turns(&ResidualTrial::X_WS, 1), commands));
  blocks.push_back(
      b.block("start heading, twice a turn", turns(&ResidualTrial::X_WS, 2), commands));
  blocks.push_back(
      b.block("start heading, four times a turn", turns(&ResidualTrial::X_WS, 4), commands));
  if (study.free_commands) {
    // Arcs end in headings that the commands' names do not show.
    blocks.push_back(b.block("end heading", turns(&ResidualTrial::X_WP, 1), commands));
    blocks.push_back(
        b.block("end heading, twice a turn", turns(&ResidualTrial::X_WP, 2), commands));
  }
  blocks.push_back(b.block("start place", mapped(start_place(study), scaled), commands));
  blocks.push_back(b.readings());
  blocks.push_back(b.block(
      "session time",
      {scaled(time), scaled([=](const ResidualTrial& t) { return time(t) * time(t); })}, commands));
  std::vector<Values> sessions;
  for (std::size_t s = 1; s < study.sessions; ++s) {
    sessions.push_back(scaled([=](const ResidualTrial& t) { return t.session == s ? 1.0 : 0.0; }));
  }
  if (!sessions.empty() && sessions.size() <= 8)
    blocks.push_back(b.block("session", sessions, commands));
  blocks.push_back(b.block("change of direction", {reversed(true), reversed(false)}, commands));
  blocks.push_back(b.block(
      "unrecorded move before",
      {scaled([](const ResidualTrial& t) { return t.context.moved ? 1.0 : 0.0; })}, commands));
  for (CovariateBlock& block : blocks_before(study, b, commands)) {
    blocks.push_back(std::move(block));
  }
  return blocks;
}

}  // namespace gapfarm
