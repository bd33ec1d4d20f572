// --page: a command's folder in a browser for as long as the command goes on.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>

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

// Starts `gapfarm serve FOLDER` where it is wanted, as a process of its own at a low priority,
// which reads the folder's store, and says where; it ends with what is returned, which is null
// where not. Without a port that the user named it takes the usual one or, when that is taken, any.
// Errors: the program cannot be started, the port is taken; as the server says it.
Result<std::shared_ptr<void>> open_page(const PageOption& option,
                                        const std::filesystem::path& folder, CliContext& context);

// `gapfarm serve`'s port unless configured otherwise.
inline constexpr unsigned kPagePort = 8421;

}  // namespace gapfarm
