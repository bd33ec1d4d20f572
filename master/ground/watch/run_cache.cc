#include "master/ground/watch/run_cache.h"

#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

namespace gapfarm {
namespace {

// Values, then the covariance row by row.
std::optional<Result<OffsetFit>> fit_of(const nlohmann::json& line) {
  if (line.contains("error") && line["error"].is_string()) {
    return Result<OffsetFit>(Error{line["error"].get<std::string>()});
  }
  if (!line.contains("values") || !line["values"].is_array()) return {};
  if (!line.contains("covariance") || !line["covariance"].is_array()) return {};
  const auto& values = line["values"];
  const auto& covariance = line["covariance"];
  const auto n = static_cast<Eigen::Index>(values.size());
  if (covariance.size() != values.size() * values.size()) return {};
  OffsetFit fit{Eigen::VectorXd(n), Eigen::MatrixXd(n, n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& value = values[static_cast<std::size_t>(i)];
    if (!value.is_number()) return {};
    fit.values[i] = value.get<double>();
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto& entry = covariance[static_cast<std::size_t>(i * n + j)];
      if (!entry.is_number()) return {};
      fit.covariance(i, j) = entry.get<double>();
    }
  }
  return Result<OffsetFit>(std::move(fit));
}

}  // namespace

RunCache::RunCache(std::filesystem::path file) : file_(std::move(file)) {
  std::ifstream from(file_);
  for (std::string text; std::getline(from, text);) {
    const auto line = nlohmann::json::parse(text, nullptr, false);
    if (!line.is_object() || !line.contains("key") || !line["key"].is_string()) continue;
    if (auto fit = fit_of(line)) fits_.insert_or_assign(line["key"].get<std::string>(), *fit);
  }
}

const Result<OffsetFit>* RunCache::find(const std::string& key) const {
  const auto found = fits_.find(key);
  return found == fits_.end() ? nullptr : &found->second;
}

const Result<OffsetFit>& RunCache::keep(const std::string& key, Result<OffsetFit> fit) {
  nlohmann::json line = {{"key", key}};
  if (fit) {
    line["values"] = std::vector<double>(fit->values.begin(), fit->values.end());
    line["covariance"] = std::vector<double>(
        fit->covariance.data(), fit->covariance.data() + fit->covariance.size());  // symmetric
  } else {
    line["error"] = fit.error().message;
  }
  // Begins a line: whatever broke off is over.
  std::ofstream(file_, std::ios::app)
      << "\n" + line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  return fits_.insert_or_assign(key, std::move(fit)).first->second;
}

}  // namespace gapfarm
