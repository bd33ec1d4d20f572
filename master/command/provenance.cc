#include "master/command/provenance.h"

#include <filesystem>

#include "common/base/hash.h"
#include "common/base/text.h"
#include "common/json/fields.h"
#include "common/trials/files.h"
#include "master/ground/fit/window_fit.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

constexpr auto kStamp = [](auto& v, auto& row) { FIELDS(command, problem, options, about, build); };

Result<Provenance> read_stamp(const std::string& file) {
  ASSIGN_OR_RETURN(const auto text, read_text_file(file));
  const Json json = parse_json(text);
  auto stamp = FieldReader::read<Provenance>(json, kStamp);
  if (stamp.problem.empty())
    return Error{file + ": does not say what was asked; choose another --out"};
  return stamp;
}

// "configs/srv1.toml, a.csv, b.csv".
std::string listed_names(const Json& about) {
  std::string text;
  for (const auto& [key, value] : about.items()) {
    for (const Json& entry : value.is_array() ? value : Json::array({value})) {
      if (!entry.is_string()) continue;
      text += (text.empty() ? "" : ", ") + entry.get<std::string>();
    }
  }
  return text.empty() ? "another problem" : text;
}

// Names of the options that differ.
std::string differing(const Json& a, const Json& b) {
  std::vector<std::string> names;
  for (const auto& [key, value] : b.items()) {
    if (!a.contains(key) || a[key] != value) names.push_back(key);
  }
  return names.empty() ? "options" : joined(names);
}

}  // namespace

std::string format_stamp(const Provenance& stamp) {
  return json_text(FieldWriter::written(stamp, kStamp), 2) + "\n";
}

Result<FolderState> compare_stamp(const std::string& folder, const std::string& result,
                                  const Provenance& stamp, bool force) {
  const std::string file = (fs::path(folder) / kStampFile).string();
  const bool finished = is_there(fs::path(folder) / result);
  if (!is_there(file)) {
    if (!finished) return FolderState::kNew;
    return Error{folder + ": holds results that do not say of what; choose another --out"};
  }
  ASSIGN_OR_RETURN(const auto there, read_stamp(file));
  const std::string of =
      folder + ": holds what '" + there.command + "' found of " + listed_names(there.about);
  if (there.command != stamp.command || there.problem != stamp.problem) {
    return Error{of + ", and this is another question (" + listed_names(stamp.about) +
                 "); choose another --out"};
  }
  if (there.options != stamp.options) {
    // A mistake in the options found late leaves simulations, which are of use to any.
    if (force || !finished) return FolderState::kReplaced;
    return Error{of + " with other " + differing(there.options, stamp.options) +
                 "; choose another --out, or --force to replace it"};
  }
  if (finished && there.build != stamp.build && !force) {
    return Error{of +
                 " by another build of gapfarm; choose another --out, or --force to replace it"};
  }
  return FolderState::kSame;
}

std::string log_hash(const RunLog& log) {
  Hasher hasher;
  for (const LoggedRun& run : log.runs) {
    hasher.add(run.session).add(run.run);
    add_rows(run.commands, &hasher);
    add_rows(run.wheel_speeds, &hasher);
    for (const PoseRow& row : run.poses) {
      hasher.add(row.t_s).add(row.X_WM.x).add(row.X_WM.y).add(row.X_WM.theta);
    }
  }
  return hasher.finish();
}

}  // namespace gapfarm
