#include "master/serve/site.h"

#include <algorithm>
#include <charconv>

#include "common/base/ranges.h"
#include "common/trials/files.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "master/report/html.h"
#include "master/report/report_html.h"

namespace gapfarm {
namespace {

constexpr double kSearchAgain_s = 2;
constexpr std::size_t kMostCompared = 8;
constexpr double kBusyPage_s = 20;
constexpr std::size_t kMostKept = 12;  // pages, of two megabytes at most

// A strong tag: what has it is the same byte by byte.
std::string hash_of(const std::string& content) { return csp_hash(content).substr(7, 32); }

HttpResponse unchanged(const std::string& etag) {
  HttpResponse response;
  response.status = 304;
  response.etag = etag;
  return response;
}

// What a page says of itself changes with its folder and with whether its process lives.
std::string tokens_of(const WorkEntry& entry) {
  return entry.stamp + run_state_name(entry.state) + "|" + entry.status_text + "|";
}

std::optional<std::uint64_t> whole_number(const std::string& text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

ListView list_view(const Target& target) {
  return {target.value("sort"), target.value("q"), target.value("state")};
}

// Of everything that a page depends on beside the stores.
std::string key_of(const Target& target) {
  std::string key = target.path;
  for (const char* name : {"of", "sort", "q", "state", "genome", "best_of"}) {
    const auto* values = find_in(target.query, name);
    if (!values) continue;
    for (const std::string& v : *values) key += std::string("&") + name + "=" + percent_encoded(v);
  }
  return key;
}

std::string no_such(const std::string& name) {
  return "Nothing is called '" + name.substr(0, 200) + "' here (any more); / lists what there is.";
}

}  // namespace

void Site::look() {
  const double now_s = sources_.unix_now_s();
  const double looked_s = now_s - looked_unix_s_;
  if (looked_s >= 0 && looked_s < good_for_s(look_cost_s_)) return;
  const double searched_s = now_s - searched_unix_s_;
  if (searched_s < 0 || searched_s >= std::max(kSearchAgain_s, good_for_s(search_cost_s_))) {
    const double began_s = sources_.cpu_now_s();
    found_ = find_work(sources_.folders);
    searched_unix_s_ = now_s;
    search_cost_s_ = sources_.cpu_now_s() - began_s;
  }
  const double began_s = sources_.cpu_now_s();
  entries_ = known_entries_.now(found_);
  looked_unix_s_ = now_s;
  look_cost_s_ = sources_.cpu_now_s() - began_s;
}

const FoundWork* Site::find(const std::string& name) const {
  return find_by(found_, name, &FoundWork::name);
}

const WorkEntry& Site::entry(const FoundWork& found) const {
  return entries_[static_cast<std::size_t>(&found - found_.data())];
}

HttpResponse Site::answer(const HttpRequest& request) {
  if (auto refused = refusal(request)) return *std::move(refused);
  const auto target = parse_target(request.target);
  look();
  return answer_at(*target, request.if_none_match);
}

HttpResponse Site::answer_at(const Target& target, const std::string& known) {
  if (target.path == "/" || target.path == "/view" || target.path == "/compare") {
    return shown(target, known);
  }
  if (target.path == "/events") return events(target);
  if (target.path == "/drive") return drive(target);
  if (target.path == "/metrics") return metrics();
  return plain_response(404, "There is no such page; / lists what there is.");
}

HttpResponse Site::metrics() const {
  HttpResponse response;
  response.content_type = "text/plain; version=0.0.4; charset=utf-8";
  response.body = metrics_text(entries_, sources_.unix_now_s());
  return response;
}

Result<Site::Standing> Site::standing(const Target& target) const {
  Standing now;
  if (target.path == "/") {
    for (const WorkEntry& e : entries_) {
      now.tag += e.name + tokens_of(e);
      now.state += e.name + run_state_name(e.state) + "|";
    }
  } else {
    const auto names = target.query.find("of");
    if (names == target.query.end()) return Error{no_such("")};
    for (const std::string& name : names->second) {
      const FoundWork* found = find(name);
      if (found == nullptr) return Error{no_such(name)};
      now.tag += tokens_of(entry(*found));
      now.state += run_state_name(entry(*found).state) + std::string("|");
    }
  }
  now.tag = hash_of(now.tag + key_of(target));
  return now;
}

const Site::Kept* Site::kept(const std::string& key, const Standing& now) const {
  const auto found = kept_.find(key);
  if (found == kept_.end()) return nullptr;
  const Kept& page = found->second;
  if (page.tag == now.tag) return &page;
  const double age_s = sources_.unix_now_s() - page.made_unix_s;
  const bool good = page.state == now.state && age_s >= 0 && age_s < good_for_s(page.cost_s);
  return good ? &page : nullptr;
}

void Site::keep(const std::string& key, Kept page) {
  if (kept_.size() >= kMostKept && !kept_.contains(key)) {
    kept_.erase(std::ranges::min_element(kept_, [](const auto& a, const auto& b) {
      return a.second.made_unix_s < b.second.made_unix_s;
    }));
  }
  kept_[key] = std::move(page);
}

HttpResponse Site::shown(const Target& target, const std::string& known) {
  if (target.path == "/compare" && !target.query.contains("of")) {
    return plain_response(400, "Choose runs in the list: /compare?of=RUN&of=RUN.");
  }
  const auto now = standing(target);
  if (!now) return plain_response(404, now.error().message);
  const std::string key = key_of(target);
  const Kept* page = kept(key, *now);
  if (page == nullptr) {
    const double began_s = sources_.cpu_now_s();
    auto html = made(target);
    // Somebody writes just now: what was seen last will do for a while.
    const auto last = kept_.find(key);
    const bool lately =
        last != kept_.end() && sources_.unix_now_s() - last->second.made_unix_s < kBusyPage_s;
    if (!html && !lately) return trouble(target, html.error());
    if (!html) return as_asked(last->second, known);
    keep(key, {now->tag, *std::move(html), now->state, sources_.unix_now_s(),
               sources_.cpu_now_s() - began_s});
    page = &kept_.at(key);
  }
  return as_asked(*page, known);
}

HttpResponse Site::as_asked(const Kept& page, const std::string& known) {
  const std::string etag = "\"" + page.tag + "\"";
  if (etag == known) return unchanged(etag);
  HttpResponse response;
  response.body = page.html;
  response.etag = etag;
  return response;
}

HttpResponse Site::trouble(const Target& target, const Error& error) const {
  HttpResponse response;
  response.status = 503;
  response.body =
      trouble_page(target.path == "/view" ? target.value("of") : "This comparison", error.message);
  return response;
}

HttpResponse Site::events(const Target& target) {
  Target watched = target;
  watched.path = target.value("at");
  watched.query.erase("at");
  const bool known = watched.path == "/" || watched.path == "/view" || watched.path == "/compare";
  if (!known) return plain_response(404, "Nothing is reported there: / lists what there is.");
  if (const auto now = standing(watched); !now) return plain_response(404, now.error().message);
  HttpResponse response;
  response.watched = [this, watched] {
    look();
    const auto now = standing(watched);
    if (!now) return std::string("gone");
    const Kept* page = kept(key_of(watched), *now);
    return page != nullptr ? page->tag : now->tag;
  };
  return response;
}

Result<std::string> Site::made(const Target& target) const {
  if (target.path == "/view") return view(target);
  if (target.path == "/compare") return compare(target);
  const auto name = [](const std::filesystem::path& folder) { return folder.string(); };
  return list_page(entries_, list_view(target), mapped(sources_.folders, name));
}

Result<std::string> Site::view(const Target& target) const {
  const FoundWork* found = find(target.value("of"));
  if (found == nullptr) return Error{no_such(target.value("of"))};
  if (found->kind == FoundWork::Kind::kRun) {
    ASSIGN_OR_RETURN(auto report,
                     sources_.read_run({found->path, whole_number(target.value("genome")),
                                        whole_number(target.value("best_of"))}));
    report.name = found->name;
    report.served = true;
    return run_html(report);
  }
  if (found->kind == FoundWork::Kind::kDiagnosis && !entry(*found).running()) {
    ASSIGN_OR_RETURN(const auto text, read_text_file((found->path / "diagnosis.json").string()));
    const auto diagnosis = parse_diagnosis(text);
    if (!diagnosis) return Error{found->name + ": " + diagnosis.error().message};
    return report_html(*diagnosis, true);
  }
  return command_page(*found, sources_.unix_now_s());
}

Result<std::string> Site::compare(const Target& target) const {
  const std::vector<std::string>& names = target.query.at("of");
  if (names.size() > kMostCompared) return Error{"At most 8 runs at a time."};
  std::vector<RunReport> runs;
  for (const std::string& name : names) {
    const FoundWork* found = find(name);
    if (found == nullptr) return Error{no_such(name)};
    if (found->kind != FoundWork::Kind::kRun) return Error{name + " is no run."};
    ASSIGN_OR_RETURN(auto report, sources_.read_run({found->path, {}, {}}));
    report.name = found->name;
    runs.push_back(std::move(report));
  }
  return compare_page(runs);
}

HttpResponse Site::drive(const Target& target) {
  const FoundWork* found = find(target.value("of"));
  if (found == nullptr || found->kind != FoundWork::Kind::kRun) {
    return plain_response(404, no_such(target.value("of")));
  }
  const auto trial = whole_number(target.value("trial"));
  const std::string generation = target.value("generation");
  const auto of_generation = whole_number(generation);
  if (!trial || *trial == 0 || (!generation.empty() && !of_generation)) {
    return plain_response(400, "A trial is a whole number from 1 on, and so is a generation.");
  }
  auto json = sources_.drive({found->path, static_cast<std::size_t>(*trial - 1),
                              generation.empty() ? std::nullopt : of_generation});
  if (!json) return plain_response(404, json.error().message);
  HttpResponse response;
  response.content_type = "application/json";
  response.body = *std::move(json);
  return response;
}

}  // namespace gapfarm
