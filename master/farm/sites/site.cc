#include <cmath>
#include <regex>
#include <string_view>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/config/toml_section.h"
#include "common/json/fields.h"
#include "master/farm/sites/fleet.h"

namespace gapfarm {
namespace {

void read_pattern(TomlSection& section, const char* key, std::string* to) {
  section.read(key, *to);
  try {
    const std::regex made(*to);
  } catch (const std::regex_error& error) {
    section.fail(key, std::string("is no pattern: ") + error.what());
  }
}

}  // namespace

Result<ClusterSite> parse_site(std::string_view text, const std::string& file) {
  ASSIGN_OR_RETURN(const toml::table table, parse_toml(text, file));
  TomlErrors errors(file);
  TomlSection v(table, "", errors);
  ClusterSite row;
  FIELDS(system, hosts, submit, script, script_a_job, ids, wall, several, avoid, nodes_between,
         list, columns, queued, ended, stuck, cancel, log, master, requeue, worker, keys,
         allow_external)
  v.read("jobs_per_host", row.jobs_per_host, 0, 100000);
  v.read("block", row.block, 1, 100000);
  v.read("first_index", row.first_index, 0, 1);
  v.read("interval", row.interval_s, 0.1, 3600, "s");
  v.read("backoff", row.backoff_s, 0.1, 3600, "s");
  read_pattern(v, "submitted", &row.submitted);
  read_pattern(v, "limit", &row.limit);
  read_pattern(v, "line", &row.line);
  v.finish();
  if (!errors.empty()) return errors.error();
  for (const auto& [key, there] : {std::pair{"submit", !row.submit.empty()},
                                   {"list", !row.list.empty()},
                                   {"cancel", !row.cancel.empty()},
                                   {"line", !row.line.empty()},
                                   {"columns", !row.columns.empty()},
                                   {"submitted", !row.submitted.empty()}}) {
    if (!there) return Error{file + ": has no '" + key + "'; see configs/sites/slurm.toml"};
  }
  return row;
}

std::string expand(const std::string& text, const SiteValues& values) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text[at] == '{' ? text.find('}', at) : text.npos;
    const auto found =
        end == text.npos ? values.end() : values.find(text.substr(at + 1, end - at - 1));
    if (found == values.end()) {
      out += text[at++];
      continue;
    }
    for (std::size_t i = 0; i < found->second.size(); ++i) {
      out += (i > 0 ? "\n" : "") + found->second[i];
    }
    at = end + 1;
  }
  return out;
}

std::vector<std::string> expand(const std::vector<std::string>& command, const SiteValues& values) {
  std::vector<std::string> all;
  for (const std::string& argument : command) {
    const bool alone = argument.size() > 2 && argument.front() == '{' && argument.back() == '}';
    const auto found = alone ? values.find(argument.substr(1, argument.size() - 2)) : values.end();
    if (found == values.end()) {
      all.push_back(expand(argument, values));
    } else {
      all.insert(all.end(), found->second.begin(), found->second.end());
    }
  }
  return all;
}

std::vector<std::string> wall_arguments(const ClusterSite& site, double seconds) {
  if (seconds <= 0) return {};
  return expand(site.wall, {{"seconds", {std::to_string(std::lround(seconds))}},
                            {"minutes", {std::to_string(std::lround(std::ceil(seconds / 60)))}}});
}

std::vector<ListedJob> parse_list(const ClusterSite& site, const std::string& name,
                                  const std::string& output) {
  const std::regex pattern(site.line);
  std::vector<ListedJob> jobs;
  for (const std::string_view line : lines_of(output)) {
    std::cmatch match;
    if (!std::regex_search(line.data(), line.data() + line.size(), match, pattern)) continue;
    ListedJob job;
    std::string task, named = name;
    for (std::size_t i = 0; i < site.columns.size() && i + 1 < match.size(); ++i) {
      const std::string& column = site.columns[i];
      const std::string value = match[i + 1];
      if (column == "id") job.id = value;
      if (column == "task") task = value;
      if (column == "state") job.state = value;
      if (column == "node") job.node = value;
      if (column == "reason") job.reason = value;
      if (column == "name") named = value;
    }
    if (!task.empty()) job.id += "." + task;
    if (named != name || job.id.empty() || contains(site.ended, job.state)) continue;
    if (contains(site.queued, job.state)) job.standing = ListedJob::kQueued;
    if (contains(site.stuck, job.state)) job.standing = ListedJob::kStuck;
    jobs.push_back(std::move(job));
  }
  return jobs;
}

std::vector<std::string> parse_submitted(const ClusterSite& site, unsigned count,
                                         const std::string& output) {
  const std::regex pattern(site.submitted);
  std::vector<std::string> matched;
  for (std::sregex_iterator one(output.begin(), output.end(), pattern), end; one != end; ++one) {
    matched.push_back((*one)[1]);
  }
  if (site.ids.empty() || matched.empty()) return matched;
  std::vector<std::string> ids;
  for (unsigned i = 0; i < count; ++i) {
    ids.push_back(expand(
        site.ids, {{"0", {matched.front()}}, {"index", {std::to_string(site.first_index + i)}}}));
  }
  return ids;
}

bool is_site_limit(const ClusterSite& site, const std::string& output) {
  return !site.limit.empty() && std::regex_search(output, std::regex(site.limit));
}

}  // namespace gapfarm
