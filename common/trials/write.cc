#include <cmath>
#include <filesystem>
#include <set>
#include <utility>

#include "common/base/text.h"
#include "common/trials/files.h"
#include "common/trials/format.h"
#include "common/trials/read.h"
#include "common/trials/text/csv.h"
#include "common/trials/text/trial_parser.h"

namespace gapfarm {
namespace {

std::string header(std::vector<std::string> names, const std::vector<std::string>& extra = {}) {
  names.insert(names.end(), extra.begin(), extra.end());
  return joined(names, ",", csv_field) + "\n";
}

std::string optional_double(const std::optional<double>& value) {
  return value ? format_double(*value) : std::string();
}

std::string pose_fields(const Pose& pose) {
  return format_double(pose.x) + "," + format_double(pose.y) + "," + format_double(pose.theta);
}

// With the line's end.
std::string extra_fields(const Trial& trial, const TrialLog& log) {
  std::string text;
  for (std::size_t i = 0; i < log.extra_columns.size(); ++i) {
    text += "," + (i < trial.extra.size() ? csv_field(trial.extra[i]) : std::string());
  }
  return text + "\n";
}

// A line a sample, with what `place` writes of where it was.
template <class Sample, class Place>
std::string format_samples(const TrialLog& log, std::vector<std::string> columns,
                           std::vector<Sample> Trial::*samples, const Place& place) {
  std::string text = header(std::move(columns));
  for (const Trial& trial : log.trials) {
    const std::string key = csv_field(trial.session) + "," + std::to_string(trial.trial) + ",";
    for (const Sample& sample : trial.*samples) {
      text += key + format_double(sample.t_s) + "," + place(sample) + "\n";
    }
  }
  return text;
}

bool is_finite(const Pose& pose) {
  return std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.theta);
}

bool is_finite(const Trial& trial) {
  for (const auto& value : {trial.t_s, trial.left, trial.right, trial.duration_s}) {
    if (value && !std::isfinite(*value)) return false;
  }
  for (const PathSample& sample : trial.path) {
    if (!std::isfinite(sample.t_s) || !is_finite(sample.pose)) return false;
  }
  for (const TipSample& sample : trial.tip) {
    if (!std::isfinite(sample.t_s + sample.x + sample.y)) return false;
  }
  return is_finite(trial.X_WS) && is_finite(trial.X_WE);
}

Status check(const TrialLog& log, const std::string& path) {
  if (log.trials.empty()) return Error{path + ": there are no trials to write"};
  std::set<std::pair<std::string, std::int64_t>> seen;
  for (const Trial& trial : log.trials) {
    const std::string name = path + ": trial " + std::to_string(trial.trial) + " of session " +
                             quoted_word(trial.session);
    if (trial.session.empty()) return Error{name + " needs a session name"};
    if (!seen.emplace(trial.session, trial.trial).second) {
      return Error{name + " occurs twice; number the trials of a session"};
    }
    if (trial.extra.size() > log.extra_columns.size()) {
      return Error{name + " has " + std::to_string(trial.extra.size()) + " extra values for " +
                   std::to_string(log.extra_columns.size()) + " columns"};
    }
    if (!is_finite(trial)) return Error{name + " holds NaN or infinity; leave such trials out"};
  }
  return {};
}

std::string beside(const std::string& path, const char* name) {
  return (std::filesystem::path(path).parent_path() / name).string();
}

}  // namespace

std::string format_trials(const TrialLog& log) {
  const bool pushes = log.has_tips();
  std::string text = header(pushes ? kPushColumns : kTrialColumns, log.extra_columns);
  for (const Trial& trial : log.trials) {
    text += csv_field(trial.session) + "," + std::to_string(trial.trial) + ",";
    if (!pushes) text += optional_double(trial.t_s) + ",";
    text += csv_field(trial.command) + ",";
    if (!pushes) {
      text += optional_double(trial.left) + "," + optional_double(trial.right) + "," +
              optional_double(trial.duration_s) + ",";
    }
    text += pose_fields(trial.X_WS) + "," + pose_fields(trial.X_WE) + extra_fields(trial, log);
  }
  return text;
}

std::string format_paths(const TrialLog& log) {
  return format_samples(log, kPathColumns, &Trial::path,
                        [](const PathSample& sample) { return pose_fields(sample.pose); });
}

std::string format_tips(const TrialLog& log) {
  return format_samples(log, kTipColumns, &Trial::tip, [](const TipSample& sample) {
    return format_double(sample.x) + "," + format_double(sample.y);
  });
}

std::vector<std::string> trial_file_names(const std::string& path, bool paths, bool tips) {
  std::vector<std::string> names = {path};
  if (paths) names.push_back(beside(path, "paths.csv"));
  if (tips) names.push_back(beside(path, "tips.csv"));
  return names;
}

Result<std::vector<TrialFile>> trial_files(const TrialLog& log, const std::string& path) {
  if (Status good = check(log, path); !good.ok()) return good.error();
  const std::string name = std::filesystem::path(path).filename().string();
  if (name == "paths.csv" || name == "tips.csv") {
    return Error{path + ": " + name + " lies beside a log and is not one; choose another name"};
  }
  // The log last: a reader that finds it then finds what belongs to it too.
  std::vector<TrialFile> files;
  std::string text = format_trials(log);
  if (log.has_paths()) {
    files.push_back({beside(path, "paths.csv"), format_mark(path, text) + format_paths(log)});
  }
  if (log.has_tips()) files.push_back({beside(path, "tips.csv"), format_tips(log)});
  files.push_back({path, std::move(text)});
  return files;
}

Status write_trials(const TrialLog& log, const std::string& path) {
  ASSIGN_OR_RETURN(const auto files, trial_files(log, path));
  for (const TrialFile& file : files) {
    if (Status written = write_file_atomically(file.path, file.text); !written.ok()) return written;
  }
  return {};
}

}  // namespace gapfarm
