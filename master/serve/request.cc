#include "master/serve/request.h"

#include <algorithm>
#include <array>

#include "common/base/ranges.h"

namespace gapfarm {
namespace {

constexpr std::size_t kLongestTarget = 4000;
constexpr std::size_t kMostValues = 32;

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

Result<std::string> decoded(std::string_view text, bool plus_is_space) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      const int high = i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
      const int low = i + 2 < text.size() ? hex_digit(text[i + 2]) : -1;
      if (high < 0 || low < 0) return Error{"a % without two hexadecimal digits after it"};
      c = static_cast<char>(16 * high + low);
      i += 2;
    } else if (c == '+' && plus_is_space) {
      c = ' ';
    }
    if (is_control(c)) return Error{"a control character"};
    out += c;
  }
  return out;
}

Status read_query(std::string_view query, Target* target) {
  std::size_t count = 0;
  while (!query.empty()) {
    const std::string_view item = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), item.size() + 1));
    if (item.empty()) continue;
    if (++count > kMostValues) return Error{"more than 32 values"};
    const std::size_t equals = std::min(item.find('='), item.size());
    ASSIGN_OR_RETURN(auto key, decoded(item.substr(0, equals), true));
    ASSIGN_OR_RETURN(auto value, decoded(item.substr(std::min(item.size(), equals + 1)), true));
    target->query[std::move(key)].push_back(std::move(value));
  }
  return {};
}

}  // namespace

HttpResponse plain_response(unsigned status, std::string text) {
  HttpResponse response;
  response.status = status;
  response.content_type = "text/plain; charset=utf-8";
  response.body = std::move(text) + "\n";
  return response;
}

std::string Target::value(const std::string& key) const {
  const auto* values = find_in(query, key);
  return values ? values->front() : std::string();
}

Result<Target> parse_target(std::string_view target) {
  if (target.size() > kLongestTarget) return Error{"longer than 4,000 bytes"};
  if (target.empty() || target.front() != '/') return Error{"no path from / on"};
  target = target.substr(0, target.find('#'));
  const std::size_t mark = std::min(target.find('?'), target.size());
  Target parsed;
  ASSIGN_OR_RETURN(parsed.path, decoded(target.substr(0, mark), false));
  if (mark < target.size()) {
    RETURN_IF_ERROR(read_query(target.substr(mark + 1), &parsed));
  }
  return parsed;
}

std::string percent_encoded(std::string_view text) {
  constexpr std::string_view kPlain = "-._~/";
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string out;
  for (const char c : text) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (letter || kPlain.find(c) != kPlain.npos) {
      out += c;
      continue;
    }
    const auto byte = static_cast<unsigned char>(c);
    out += {'%', kDigits[byte / 16], kDigits[byte % 16]};
  }
  return out;
}

bool is_loopback_host(std::string_view host) {
  const std::size_t colon = host.rfind(':');
  if (colon != host.npos && host.find(']', colon) == host.npos) {
    const std::string_view port = host.substr(colon + 1);
    const bool number = !port.empty() && port.size() <= 5 &&
                        std::ranges::all_of(port, [](char c) { return c >= '0' && c <= '9'; });
    if (!number) return false;
    host = host.substr(0, colon);
  }
  constexpr std::array<std::string_view, 3> kNames = {"localhost", "127.0.0.1", "[::1]"};
  return contains(kNames, host);
}

std::optional<HttpResponse> refusal(const HttpRequest& request) {
  if (request.method != "GET" && request.method != "HEAD") {
    HttpResponse response = plain_response(405, "This page can only be read: GET and HEAD.");
    response.allow = "GET, HEAD";
    return response;
  }
  if (!is_loopback_host(request.host)) {
    return plain_response(421,
                          "This server answers as localhost and 127.0.0.1 only; from another "
                          "machine forward its port with ssh -L.");
  }
  if (const auto target = parse_target(request.target); !target) {
    return plain_response(400, "The address has " + target.error().message + ".");
  }
  return std::nullopt;
}

}  // namespace gapfarm
