// A page of figures for Prometheus, on this machine only.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "common/base/result.h"

namespace gapfarm {

// Answers GET /metrics with the page that was published last, from a thread of its own, one client
// after the other.  A client has a second to say what it wants.
class MetricsServer {
 public:
  // On 127.0.0.1.  `port` 0: any.  Error: the port is taken.
  static Result<std::unique_ptr<MetricsServer>> listen(unsigned port);
  ~MetricsServer();
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;

  unsigned port() const { return port_; }
  void publish(std::string page);

 private:
  MetricsServer(int listener, int wake, unsigned port);
  void run();
  void answer(int client);

  int listener_;
  int wake_;
  unsigned port_;
  std::mutex mutex_;
  std::string page_;
  std::thread thread_;  // last: it uses the rest
};

// Lines of a page in Prometheus' text format, version 0.0.4.
class MetricsPage {
 public:
  enum Type { kGauge, kCounter };
  // `name` without the program's prefix; `help`: one line.
  void add(const std::string& name, Type type, const std::string& help, double value);
  // One more value of the metric that was added last, or its first with add_labelled alone.
  void add_labelled(const std::string& name, Type type, const std::string& help,
                    const std::string& label, const std::string& label_value, double value);
  const std::string& text() const { return text_; }

 private:
  void head(const std::string& name, Type type, const std::string& help);
  std::string text_;
  std::string last_;
};

}  // namespace gapfarm
