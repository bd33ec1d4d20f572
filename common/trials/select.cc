#include <algorithm>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/trials/text/csv.h"
#include "common/trials/trial.h"

namespace gapfarm {
namespace {

bool same(std::string_view a, std::string_view b) {
  const auto x = parse_double(a);
  const auto y = parse_double(b);
  return x && y ? *x == *y : a == b;
}

}  // namespace

Result<TrialColumnReader> trial_column_reader(const TrialLog& log, const std::string& column) {
  if (column == "session") return TrialColumnReader([](const Trial& t) { return t.session; });
  if (column == "trial") {
    return TrialColumnReader([](const Trial& t) { return std::to_string(t.trial); });
  }
  if (column == "command" || column == "object") {
    return TrialColumnReader([](const Trial& t) { return t.command; });
  }
  const auto& extra = log.extra_columns;
  const auto found = std::ranges::find(extra, column);
  if (found == extra.end()) {
    std::vector<std::string> known = {"session", "trial", "command", "object"};
    append(known, extra);
    return Error{"the log has no column '" + column + "'" + suggestion(column, known)};
  }
  const auto i = static_cast<std::size_t>(found - extra.begin());
  return TrialColumnReader(
      [i](const Trial& t) { return i < t.extra.size() ? t.extra[i] : std::string(); });
}

Result<TrialLog> select_trials(const TrialLog& log, std::span<const std::string> filters) {
  TrialLog chosen = log;
  for (const std::string& filter : filters) {
    const auto [column, list] = cut_at(filter, '=');
    if (column.empty() || !list) return Error{filter + ": expected COLUMN=VALUE[,VALUE...]"};
    ASSIGN_OR_RETURN(const auto reader, under(filter, trial_column_reader(log, column)));
    const auto values = parts_of(*list, ',');
    std::erase_if(chosen.trials, [&](const Trial& trial) {
      const std::string word = reader(trial);
      return std::none_of(values.begin(), values.end(),
                          [&](std::string_view value) { return same(word, value); });
    });
    if (chosen.trials.empty()) return Error{filter + ": no trials are left"};
  }
  return chosen;
}

TrialLog shifted(TrialLog log, double dx_m, double dy_m) {
  if (dx_m == 0 && dy_m == 0) return log;
  const auto move = [&](double* x, double* y) { *x += dx_m, *y += dy_m; };
  for (Trial& t : log.trials) {
    move(&t.X_WS.x, &t.X_WS.y);
    move(&t.X_WE.x, &t.X_WE.y);
    for (PathSample& s : t.path) move(&s.pose.x, &s.pose.y);
    for (TipSample& s : t.tip) move(&s.x, &s.y);
  }
  return log;
}

}  // namespace gapfarm
