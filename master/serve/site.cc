#include "master/serve/site.h"

#include <algorithm>
#include <charconv>

#include "common/trials/files.h"
#include "master/diagnose/diagnosis_json.h"
#include "master/report/html.h"
#include "master/report/report_html.h"
#include "master/serve/pages.h"

namespace gapfarm {
namespace {

constexpr double kSearchAgain_s = 2;
constexpr std::size_t kMostCompared = 8;

std::string quoted_hash(const std::string& content) {
  // A strong tag: what has it is the same byte by byte.
  return "\"" + csp_hash(content).substr(7, 32) + "\"";
}

HttpResponse page(std::string html, std::string etag) {
  HttpResponse response;
  response.body = std::move(html);
  response.etag = std::move(etag);
  return response;
}

HttpResponse unchanged(const std::string& etag) {
  HttpResponse response;
  response.status = 304;
  response.etag = etag;
  return response;
}

// What a page says of itself changes with its folder and with whether its process lives.
std::string etag_of(const FoundWork& found, const WorkEntry& entry) {
  return quoted_hash(stamp_of(found.path) + entry.state + "|" + entry.told);
}

std::optional<std::uint64_t> whole_number(const std::string& text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

void Site::look() {
  const double now_s = sources_.unix_now_s();
  if (now_s - searched_unix_s_ >= kSearchAgain_s || now_s < searched_unix_s_) {
    found_ = find_work(sources_.folders);
    searched_unix_s_ = now_s;
  }
  entries_ = known_entries_.now(found_, now_s);
}

const FoundWork* Site::find(const std::string& name) const {
  const auto found = std::find_if(found_.begin(), found_.end(),
                                  [&](const FoundWork& f) { return f.name == name; });
  return found == found_.end() ? nullptr : &*found;
}

const WorkEntry& Site::entry(const FoundWork& found) const {
  return entries_[static_cast<std::size_t>(&found - found_.data())];
}

HttpResponse Site::no_such(const std::string& name) const {
  return plain_response(404, "Nothing is called '" + name.substr(0, 200) +
                                 "' here (any more); / lists what there is.");
}

HttpResponse Site::answer(const HttpRequest& request) {
  if (auto refused = refusal(request)) return *std::move(refused);
  const auto target = parse_target(request.target);
  look();
  return page_at(*target, request.if_none_match);
}

HttpResponse Site::page_at(const Target& target, const std::string& known) {
  if (target.path == "/") return list(target, known);
  if (target.path == "/view") return view(target, known);
  if (target.path == "/compare") return compare(target, known);
  if (target.path == "/drive") return drive(target);
  if (target.path == "/metrics") {
    HttpResponse response = plain_response(200, "");
    response.content_type = "text/plain; version=0.0.4; charset=utf-8";
    response.body = metrics_text(entries_, sources_.unix_now_s());
    return response;
  }
  return plain_response(404, "There is no such page; / lists what there is.");
}

HttpResponse Site::list(const Target& target, const std::string& known) const {
  std::vector<std::string> folders;
  for (const auto& folder : sources_.folders) folders.push_back(folder.string());
  std::string html = list_page(entries_, target.value("sort"), folders);
  const std::string etag = quoted_hash(html);
  return etag == known ? unchanged(etag) : page(std::move(html), etag);
}

HttpResponse Site::view(const Target& target, const std::string& known) {
  const FoundWork* found = find(target.value("of"));
  if (found == nullptr) return no_such(target.value("of"));
  const WorkEntry& now = entry(*found);
  const std::string etag = etag_of(*found, now);
  if (etag == known) return unchanged(etag);
  if (found->kind == FoundWork::Kind::kRun) {
    auto report = sources_.read_run(found->path);
    if (!report) return plain_response(500, report.error().message);
    report->name = found->name;
    report->served = true;
    return page(run_html(*report), etag);
  }
  if (found->kind == FoundWork::Kind::kDiagnosis && now.state != "running") {
    const auto text = read_text_file((found->path / "diagnosis.json").string());
    if (!text) return plain_response(500, text.error().message);
    const auto diagnosis = parse_diagnosis(*text);
    if (!diagnosis) return plain_response(500, found->name + ": " + diagnosis.error().message);
    return page(report_html(*diagnosis, true), etag);
  }
  auto html = command_page(*found, sources_.unix_now_s());
  if (!html) return plain_response(500, html.error().message);
  return page(*std::move(html), etag);
}

HttpResponse Site::compare(const Target& target, const std::string& known) {
  const auto names = target.query.find("of");
  if (names == target.query.end()) {
    return plain_response(400, "Choose runs in the list: /compare?of=RUN&of=RUN.");
  }
  if (names->second.size() > kMostCompared) return plain_response(400, "At most 8 runs at a time.");
  std::string tags;
  std::vector<const FoundWork*> chosen;
  for (const std::string& name : names->second) {
    const FoundWork* found = find(name);
    if (found == nullptr) return no_such(name);
    if (found->kind != FoundWork::Kind::kRun) return plain_response(400, name + " is no run.");
    chosen.push_back(found);
    tags += etag_of(*found, entry(*found));
  }
  const std::string etag = quoted_hash(tags);
  if (etag == known) return unchanged(etag);
  std::vector<RunReport> runs;
  for (const FoundWork* found : chosen) {
    auto report = sources_.read_run(found->path);
    if (!report) return plain_response(500, report.error().message);
    report->name = found->name;
    runs.push_back(*std::move(report));
  }
  return page(compare_page(runs), etag);
}

HttpResponse Site::drive(const Target& target) {
  const FoundWork* found = find(target.value("of"));
  if (found == nullptr || found->kind != FoundWork::Kind::kRun) return no_such(target.value("of"));
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
