#include "master/command/page_along.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <string_view>

#include "common/base/clock.h"
#include "common/base/text.h"
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

}  // namespace

void PageOption::declare(CLI::App& app) {
  app.add_flag("--page", along,
               "Show it in a browser while it goes on (`gapfarm serve`), and print the address");
  app.add_option("--page-port,--metrics", port,
                 "The same on this port of 127.0.0.1 (0: any); /metrics there is for Prometheus")
      ->check(CLI::Range(0, 65535))
      ->type_name("PORT");
}

Result<std::unique_ptr<PageAlong>> PageAlong::start(const std::filesystem::path& folder,
                                                    unsigned port) {
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
  std::unique_ptr<PageAlong> page(new PageAlong(*pid, ends[0]));
  const std::string output = page->hear();
  const std::string digits = up_to(output, kAddress, "/");
  page->tunnel_ = up_to(output, kTunnel, ",");
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), page->port_);
  if (digits.empty() || error != std::errc() || page->tunnel_.empty()) {
    return Error{"the page cannot be shown: " + complaint(output)};
  }
  return page;
}

std::string PageAlong::hear() const {
  std::string output;
  std::array<char, 1024> bytes;
  const double until_s = monotonic_seconds() + 1e-3 * kStartLimit_ms;
  while (output.find(", then open") == output.npos) {
    const double left_s = until_s - monotonic_seconds();
    pollfd polled = {out_, POLLIN, 0};
    if (left_s <= 0 || ::poll(&polled, 1, static_cast<int>(1e3 * left_s) + 1) <= 0) break;
    const ssize_t n = ::read(out_, bytes.data(), bytes.size());
    if (n <= 0) break;
    output.append(bytes.data(), static_cast<std::size_t>(n));
  }
  return output;
}

PageAlong::~PageAlong() { ::close(out_); }

Result<std::unique_ptr<PageAlong>> open_page(const PageOption& option,
                                             const std::filesystem::path& folder,
                                             CliContext& context) {
  if (!option.wanted()) return std::unique_ptr<PageAlong>();
  const std::optional<unsigned>& named = option.port;
  auto page = PageAlong::start(folder, named.value_or(kPagePort));
  if (!page && !named) page = PageAlong::start(folder, 0);
  if (!page) return page.error();
  const std::string address = "http://127.0.0.1:" + std::to_string((*page)->port()) + "/";
  const std::string view =
      address + "view?of=" + percent_encoded(folder.lexically_normal().string());
  context.console.note("page: " + view);
  context.console.note("  from another machine first: " + (*page)->tunnel());
  context.console.note("  it ends with this command; gapfarm serve " +
                       shell_quoted(folder.string()) + " shows the same at any time");
  if (named) context.console.note("metrics: " + address + "metrics");
  return page;
}

}  // namespace gapfarm
