// --page: a command's folder in a browser for as long as the command goes on.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/process/child.h"

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

  // Errors: the program cannot be started, the port is taken; as the server says it.
  static Result<std::unique_ptr<PageAlong>> start(const std::filesystem::path& folder,
                                                  unsigned port);
  unsigned port() const { return port_; }
  const std::string& tunnel() const { return tunnel_; }  // "ssh -L ..."

 private:
  PageAlong(pid_t pid, int out) : out_(out), server_(pid, /*patience_s=*/3) {}
  // What the server reported until it served or ended.
  std::string hear() const;

  int out_;  // its standard output
  OwnedChild server_;
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
