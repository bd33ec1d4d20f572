// --page: a command's folder in a browser for as long as the command goes on.
#pragma once

#include <sys/types.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/base/result.h"

namespace gapfarm {

struct CliContext;

// --page, --page-port and --metrics.
struct PageOption {
  bool along = false;
  std::optional<unsigned> port;

  void declare(CLI::App& app);
  bool wanted() const { return along || port; }
};

// `gapfarm serve FOLDER` as a process of its own, at a low priority, which reads the folder's store
// and ends with this or with the process.
class PageAlong {
 public:
  ~PageAlong();
  PageAlong& operator=(PageAlong&&) = delete;

  // Errors: the program cannot be started, the port is taken; as the server says it.
  static Result<std::unique_ptr<PageAlong>> start(const std::filesystem::path& folder,
                                                  unsigned port);
  unsigned port() const { return port_; }
  const std::string& tunnel() const { return tunnel_; }  // "ssh -L ..."

 private:
  PageAlong(pid_t pid, int out) : pid_(pid), out_(out) {}
  // What the server reported until it served or ended.
  std::string hear() const;

  pid_t pid_;
  int out_;  // its standard output
  unsigned port_ = 0;
  std::string tunnel_;
};

// Starts one where it is wanted, and says where; null where not.  Without a port that the user
// named it takes the usual one or, when that is taken, any.
Result<std::unique_ptr<PageAlong>> open_page(const PageOption& option,
                                             const std::filesystem::path& folder,
                                             CliContext& context);

// `gapfarm serve`'s port unless configured otherwise.
inline constexpr unsigned kPagePort = 8421;

}  // namespace gapfarm
