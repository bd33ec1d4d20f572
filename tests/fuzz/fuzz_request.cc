// What a browser asks `gapfarm serve` for: no crash, no page for another host or method, addresses
// decoded as they were encoded, nothing found outside of what is there.
#include "master/serve/request.h"
#include "master/serve/site.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using namespace gapfarm;

// A server of nothing: what it is asked for cannot be there.
Site& empty_site() {
  static Site site([] {
    SiteSources sources;
    sources.unix_now_s = [] { return 1e9; };
    sources.cpu_now_s = [] { return 0.0; };
    sources.read_run = [](const RunQuestion&) -> Result<RunReport> {
      promise(false, "a run was read that is not there");
      return Error{""};
    };
    sources.drive = [](const DriveQuestion&) -> Result<std::string> {
      promise(false, "a run was driven that is not there");
      return Error{""};
    };
    return sources;
  }());
  return site;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // Lines: method, target, host, known tag.
  std::string lines[4];
  std::string_view rest = bytes_of(data, size);
  for (std::string& line : lines) {
    line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
  }
  const HttpResponse response = empty_site().answer({lines[0], lines[1], lines[2], lines[3]});
  if (response.status < 400) {
    promise(lines[0] == "GET" || lines[0] == "HEAD", "only readers get a page");
    promise(is_loopback_host(lines[2]), "only this machine gets a page");
  }
  if (const auto target = parse_target(lines[1])) {
    const auto again = parse_target(percent_encoded(target->path));
    promise(again.ok() && again->path == target->path, "a path reads back as it was encoded");
  }
  return 0;
}
