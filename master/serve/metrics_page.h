// Prometheus' text format, version 0.0.4.
#pragma once

#include <string>

namespace gapfarm {

class MetricsPage {
 public:
  enum Type { kGauge, kCounter };
  // One value of metric `name` (without the program's prefix) with the labels `labels`, as
  // label() makes them, joined by commas.  Values of a metric follow one another.
  void add(const std::string& name, Type type, const std::string& help, const std::string& labels,
           double value);
  const std::string& text() const { return text_; }

  // KEY="VALUE", escaped.
  static std::string label(const std::string& key, const std::string& value);

 private:
  std::string text_;
  std::string last_;
};

}  // namespace gapfarm
