// Serves pages on this machine's loopback, to browsers that may be slow, broken or hostile.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>

#include "common/base/result.h"
#include "master/serve/request.h"

namespace gapfarm {

struct HttpLimits {
  std::size_t connections = 64;  // one more closes the one that has been quiet for longest
  std::uint32_t header_bytes = 8192;
  std::chrono::milliseconds time{10000};  // to say what is wanted, and to take the answer
  std::size_t streams = 16;               // of events, among the connections; one more is refused
  std::chrono::milliseconds watch_interval{1000};
};

class HttpServer {
 public:
  // On 127.0.0.1.  `port` 0: any.  Errors: the port is taken.
  static Result<std::unique_ptr<HttpServer>> listen(std::uint16_t port, HttpHandler handler,
                                                    const HttpLimits& limits = {});
  virtual ~HttpServer() = default;

  virtual std::uint16_t port() const = 0;
  // Answers until stop_fd becomes readable.  The handler runs in this thread, a request at a time.
  virtual void run(int stop_fd) = 0;
};

}  // namespace gapfarm
