// What a browser asks of the page, and what it gets: no sockets here.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

struct HttpRequest {
  std::string method;  // "GET"
  std::string target;  // "/run?of=demo", as it came
  std::string host;    // the Host header; empty: none
  std::string if_none_match;
};

struct HttpResponse {
  unsigned status = 200;
  std::string content_type = "text/html; charset=utf-8";
  std::string body;
  std::string etag;   // with quotes; empty: none
  std::string allow;  // of a 405
  // Of a stream of events: what is watched as it is now.  It is asked about once a second, and what
  // is not as before is sent.  Empty: the body is the answer.
  std::function<std::string()> watched;
};

using HttpHandler = std::function<HttpResponse(const HttpRequest&)>;

// A short answer in plain text.
HttpResponse plain_response(unsigned status, std::string text);

struct Target {
  std::string path;
  std::map<std::string, std::vector<std::string>> query;

  // The first value of `key`; empty without one.
  std::string value(const std::string& key) const;
};

// Decoded; "+" is a space in the query.  Errors: longer than 4,000 bytes, no path from "/" on, a
// bad escape, control characters, more than 32 values.
Result<Target> parse_target(std::string_view target);

// For a query's value.
std::string percent_encoded(std::string_view text);

// Whether a request may be for this machine's loopback: a page of another site that gave its name
// this machine's address (DNS rebinding) sends that name.  Ports may differ: they are forwarded.
bool is_loopback_host(std::string_view host);

// What comes before any page: 405 for what only GET and HEAD may do, 421 for a Host that is not
// this machine, 400 for a target that is none.  None: go on.
std::optional<HttpResponse> refusal(const HttpRequest& request);

}  // namespace gapfarm
