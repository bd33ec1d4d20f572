#include "master/report/html.h"

#include <sodium.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <span>
#include <sstream>
#include <utility>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "master/report/page_texts.h"

namespace gapfarm {
namespace {

constexpr const char* kDash = "–";
constexpr const char* kMinus = "−";
constexpr const char* kRaised[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};

double clamped_percent(double share) {
  return std::isfinite(share) ? 100 * std::clamp(share, 0.0, 1.0) : 0;
}

// "4.1 × 10⁻⁶".
std::string scientific_text(double size, int digits) {
  const int power = static_cast<int>(std::floor(std::log10(size)));
  std::string raised = power < 0 ? "⁻" : "";
  for (const char digit : std::to_string(std::abs(power))) raised += kRaised[digit - '0'];
  return fmt::format("{:.{}g} × 10{}", size / std::pow(10, power), digits, raised);
}

using Escape = std::pair<char, std::string_view>;

constexpr Escape kInHtml[] = {
    {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}, {'\'', "&#39;"}};
constexpr Escape kInScript[] = {{'<', "\\u003c"}, {'>', "\\u003e"}, {'&', "\\u0026"}};

std::string escaped(std::string_view text, std::span<const Escape> escapes) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    const bool control = static_cast<unsigned char>(c) < 0x20 && c != '\t' && c != '\n';
    if (const Escape* escape = find_by(escapes, c, &Escape::first)) {
      out += escape->second;
    } else if (control) {
      out += "\xEF\xBF\xBD";
    } else {
      out += c;
    }
  }
  return out;
}

}  // namespace

std::string html_escaped(std::string_view text) { return escaped(text, kInHtml); }

std::string script_safe(std::string_view json) { return escaped(json, kInScript); }

std::string number_text(double value, int digits) {
  if (!std::isfinite(value)) return kDash;
  double size = std::abs(value);
  if (size < 1000) size = rounded_to_digits(size, digits);
  std::string text = "0";
  if (size >= 1000 && size < 1e15) {
    text = fmt::format("{:.0f}", size);
    for (std::size_t at = text.size(); at > 3;) text.insert(at -= 3, ",");
  } else if (size != 0 && (size < 1e-4 || size >= 1e15)) {
    text = scientific_text(size, digits);
  } else if (size != 0) {
    // Never with an exponent: 130, not 1.3e+02.
    const int power = static_cast<int>(std::floor(std::log10(size)));
    text = fmt::format("{:.{}f}", size, std::max(0, digits - 1 - power));
    if (text.find('.') != std::string::npos) {
      text.erase(text.find_last_not_of('0') + 1);
      if (text.back() == '.') text.pop_back();
    }
  }
  return (value < 0 && text != "0" ? kMinus : "") + text;
}

std::string with_unit(std::string text, std::string_view unit, std::string_view between) {
  if (!unit.empty() && unit != "-") text.append(between).append(unit);
  return text;
}

std::string percent_text(double share) {
  if (!std::isfinite(share)) return kDash;
  const double percent = std::round(100 * share);
  return (percent < 0 ? kMinus : "") + fmt::format("{:.0f} %", std::abs(percent));
}

std::string p_text(double p) {
  if (!std::isfinite(p)) return kDash;
  return p < 1e-4 ? "< 0.0001" : fmt::format("{:.2g}", p);
}

std::string html_table(std::string_view css, std::string_view file, std::string_view caption,
                       const std::vector<HtmlColumn>& columns, const std::vector<HtmlRow>& rows) {
  std::string html =
      fmt::format(R"(<table class="{}"{}><caption class="unseen">{}</caption><thead><tr>)", css,
                  file.empty() ? "" : fmt::format(R"( data-file="{}")", html_escaped(file)),
                  html_escaped(caption));
  for (const HtmlColumn& column : columns) {
    html += fmt::format(R"(<th scope="col"{}{}>{}</th>)",
                        column.css.rfind("number", 0) == 0 ? R"( class="number")" : "",
                        column.sorted_by ? R"( aria-sort="descending")" : "", column.head);
  }
  html += "</tr></thead><tbody>";
  for (const HtmlRow& row : rows) {
    html += row.css.empty() ? "<tr>" : fmt::format(R"(<tr class="{}">)", row.css);
    html += R"(<th scope="row">)" + row.head + "</th>";
    for (std::size_t i = 0; i < row.cells.size(); ++i) {
      const HtmlColumn& column = columns[i + 1];
      const std::string& cell = row.cells[i];
      // Where rows become cards, cells without content are omitted.
      html += fmt::format(R"(<td class="{}{}" data-label="{}">{}</td>)", column.css,
                          cell.empty() || cell == "–" ? " empty" : "",
                          column.label.empty() ? column.head : column.label, cell);
    }
    html += "</tr>";
  }
  return html + "</tbody></table>";
}

std::string html_names(const std::vector<std::string>& names, std::string_view between) {
  return joined(names, between,
                [](const std::string& name) { return "<code>" + html_escaped(name) + "</code>"; });
}

std::string html_list(const std::vector<std::string>& lines, std::string_view css) {
  std::string html = css.empty() ? "<ul>" : fmt::format(R"(<ul class="{}">)", css);
  for (const std::string& line : lines) html += "<li>" + html_escaped(line) + "</li>";
  return html + "</ul>";
}

std::string html_section(std::string_view id, std::string_view heading, std::string_view content) {
  return fmt::format("<section id=\"{}\"><h2>{}</h2>{}</section>\n", id, heading, content);
}

std::string html_definitions(const std::vector<std::pair<std::string, std::string>>& rows) {
  std::string html = R"(<dl class="provenance">)";
  for (const auto& [label, value] : rows) {
    html += "<div><dt>" + html_escaped(label) + "</dt><dd>" + html_escaped(value) + "</dd></div>";
  }
  return html + "</dl>";
}

std::string csp_hash(std::string_view content) {
  std::array<unsigned char, crypto_hash_sha256_BYTES> digest;
  crypto_hash_sha256(digest.data(), reinterpret_cast<const unsigned char*>(content.data()),
                     content.size());
  std::array<char,
             sodium_base64_ENCODED_LEN(crypto_hash_sha256_BYTES, sodium_base64_VARIANT_ORIGINAL)>
      text{};
  sodium_bin2base64(text.data(), text.size(), digest.data(), digest.size(),
                    sodium_base64_VARIANT_ORIGINAL);
  return std::string("sha256-") + text.data();
}

std::string bar_svg(double share, std::string_view css_class) {
  return fmt::format(
      R"(<svg class="bar" aria-hidden="true"><rect class="track" width="100%" height="100%"/>)"
      R"(<rect class="{}" width="{:.2f}%" height="100%"/></svg>)",
      css_class, clamped_percent(share));
}

std::string html_tile(std::string_view title, const std::string& before, std::string_view after,
                      std::string_view unit, std::string_view small) {
  return fmt::format(
      R"(<div class="tile"><dt>{}</dt><dd>{}<strong>{}</strong> {}{}</dd></div>)", title,
      before.empty()
          ? ""
          : R"(<span class="from">)" + before + R"(</span> <span aria-label="to">→</span> )",
      after, unit, small);
}

std::string interval_svg(double value, double lo, double hi) {
  const double from = clamped_percent(lo), to = clamped_percent(hi);
  return fmt::format(
      R"(<svg class="interval" aria-hidden="true"><line class="axis" x1="0" x2="100%" y1="50%" y2="50%"/>)"
      R"(<line class="tick" x1="0" x2="0" y1="20%" y2="80%"/>)"
      R"(<line class="tick" x1="50%" x2="50%" y1="30%" y2="70%"/>)"
      R"(<line class="tick" x1="100%" x2="100%" y1="20%" y2="80%"/>)"
      R"(<line class="range" x1="{0:.2f}%" x2="{1:.2f}%" y1="50%" y2="50%"/>)"
      R"(<line class="range" x1="{0:.2f}%" x2="{0:.2f}%" y1="25%" y2="75%"/>)"
      R"(<line class="range" x1="{1:.2f}%" x2="{1:.2f}%" y1="25%" y2="75%"/>)"
      R"(<circle class="value" cx="{2:.2f}%" cy="50%" r="5"/></svg>)",
      from, to, clamped_percent(value));
}

namespace {

struct Entry {
  std::string id, name, text;
};

// Of glossary.txt: a line "id: name", and below it the text with two blanks before each line.
std::vector<Entry> read_entries() {
  std::vector<Entry> all;
  std::istringstream lines(kGlossary);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("  ")) {
      all.back().text += line.substr(all.back().text.empty() ? 2 : 1);
    } else {
      const std::size_t colon = line.find(": ");
      all.push_back({line.substr(0, colon), line.substr(colon + 2), ""});
    }
  }
  return all;
}

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = read_entries();
  return all;
}

std::string link_to(std::string_view id) { return fmt::format(R"(href="#term-{}")", id); }

}  // namespace

std::string term(std::string_view id, std::string_view shown) {
  assert(contains(entries(), id, &Entry::id));
  return fmt::format(R"(<a class="term" {}>{}</a>)", link_to(id), html_escaped(shown));
}

std::string glossary_of(std::string_view page) {
  std::string html;
  for (const Entry& entry : entries()) {
    if (page.find(link_to(entry.id)) == page.npos) continue;
    html += fmt::format(R"(<div id="term-{}"><dt>{}</dt><dd>{}</dd></div>)", entry.id,
                        html_escaped(entry.name), html_escaped(entry.text));
  }
  if (html.empty()) return html;
  return R"(<section id="words" data-live><h2>Words</h2><dl class="glossary">)" + html +
         "</dl></section>\n";
}

}  // namespace gapfarm
