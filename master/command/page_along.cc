#include "master/command/page_along.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "common/process/child.h"
#include "common/process/process_pool.h"
#include "master/command/console.h"
#include "master/serve/request.h"

namespace gapfarm {
namespace {

constexpr int kStartLimit_ms = 20000;
constexpr int kLower = 10;  // a page can wait, a simulation should not
constexpr std::string_view kAddress = "serving http://127.0.0.1:";
constexpr std::string_view kTunnel = "from another machine: ";

std::string up_to(std::string_view text, std::string_view mark, std::string_view end) {
  const std::size_t at = text.find(mark);
  if (at == text.npos) return "";
  text.remove_prefix(at + mark.size());
  return std::string(text.substr(0, text.find(end)));
}

// Of what a server that did not come up says, the sentence.
std::string complaint(std::string output) {
  constexpr std::string_view kProgram = "gapfarm: ";
  if (output.starts_with(kProgram)) output.erase(0, kProgram.size());
  while (!output.empty() && output.back() == '\n') output.pop_back();
  return output.empty() ? "it ended without a word" : output;
}

// What the server reported until it served or ended.
std::string hear(int out) {
  std::string output;
  std::array<char, 1024> bytes;
  const double until_s = monotonic_seconds() + 1e-3 * kStartLimit_ms;
  while (output.find(", then open") == output.npos) {
    const double left_s = until_s - monotonic_seconds();
    pollfd polled = {out, POLLIN, 0};
    if (left_s <= 0 || ::poll(&polled, 1, static_cast<int>(1e3 * left_s) + 1) <= 0) break;
    const ssize_t n = ::read(out, bytes.data(), bytes.size());
    if (n <= 0) break;
    output.append(bytes.data(), static_cast<std::size_t>(n));
  }
  return output;
}

struct Server {
  Server(pid_t pid, int its_out) : out(its_out), process(pid, /*patience_s=*/3) {}
  ~Server() { ::close(out); }
  Server& operator=(Server&&) = delete;

  int out;  // its standard output
  OwnedChild process;
  unsigned port = 0;
  std::string tunnel;  // "ssh -L ..."
};

Result<std::shared_ptr<Server>> start_server(const std::filesystem::path& folder, unsigned port) {
  std::array<int, 2> ends = {};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    return Error{std::string("the page cannot be started: ") + std::strerror(errno)};
  }
  // Whoever listens stops at the address: what comes later is dropped and blocks nobody.
  ::fcntl(ends[1], F_SETFL, O_NONBLOCK);
  ChildSetup setup;
  setup.arguments = {executable_path(),    "serve", "--port",
                     std::to_string(port), "--",    folder.string()};
  setup.out = setup.err = ends[1];
  setup.death_signal = SIGTERM;
  setup.leads_group = true;  // Ctrl-C is for the command, which ends this when it is done
  setup.niceness = kLower;
  const Result<pid_t> pid = start_child(setup);
  ::close(ends[1]);
  if (!pid) {
    ::close(ends[0]);
    return Error{"the page cannot be started: " + pid.error().message};
  }
  auto server = std::make_shared<Server>(*pid, ends[0]);
  const std::string output = hear(ends[0]);
  const std::string digits = up_to(output, kAddress, "/");
  server->tunnel = up_to(output, kTunnel, ",");
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), server->port);
  if (digits.empty() || error != std::errc() || server->tunnel.empty()) {
    return Error{"the page cannot be shown: " + complaint(output)};
  }
  return server;
}

}  // namespace

void PageOption::declare(CLI::App& app) {
  app.add_flag("--page", along,
               "Show it in a browser while it goes on (`gapfarm serve`), and print the address");
  app.add_option("--page-port,--metrics", port,
                 "The same on this port of 127.0.0.1 (0: any); /metrics there is for Prometheus")
      ->check(CLI::Range(0, 65535))
      ->type_name("PORT");
}

Result<std::shared_ptr<void>> open_page(const PageOption& option,
                                        const std::filesystem::path& folder, CliContext& context) {
  if (!option.wanted()) return std::shared_ptr<void>();
  const std::optional<unsigned>& named = option.port;
  auto server = start_server(folder, named.value_or(kPagePort));
  if (!server && !named) server = start_server(folder, 0);
  if (!server) return server.error();
  const std::string address = "http://127.0.0.1:" + std::to_string((*server)->port) + "/";
  const std::string view =
      address + "view?of=" + percent_encoded(folder.lexically_normal().string());
  context.console.note("page: " + view);
  context.console.note("  from another machine first: " + (*server)->tunnel);
  context.console.note("  it ends with this command; gapfarm serve " +
                       shell_quoted(folder.string()) + " shows the same at any time");
  if (named) context.console.note("metrics: " + address + "metrics");
  return std::shared_ptr<void>(*std::move(server));
}

}  // namespace gapfarm
