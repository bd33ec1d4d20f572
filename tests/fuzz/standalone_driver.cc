// Runs a fuzz target without libFuzzer: every file of the corpus, then a fixed number of mutations
// of them, the same ones in every run.
//
//   fuzz_TARGET MUTATIONS FILE_OR_FOLDER...
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "common/random/stream.h"
#include "common/trials/files.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

// Pieces that parsers trip over.
const std::vector<std::string> kPieces = {
    ",",      ";",       "\"",  "\n",   "\r\n",  "\xEF\xBB\xBF", std::string(1, '\0'),
    "\xFF",   "nan",     "inf", "-",    "1e999", "-0",           "9223372036854775808",
    "0x1p3",  "move(",   "[",   "]]",   "{",     "= ",           "'''",
    "#",      "\\u0000", ".",   "[a.b", "\t",    "\xC3\x28",     "e-",
    "5e-324", "true"};

std::size_t below(gapfarm::Stream& stream, std::size_t bound) {
  return bound == 0 ? 0 : static_cast<std::size_t>(stream.bits() % bound);
}

void mutate(std::string& text, const std::string& other, gapfarm::Stream& stream) {
  const std::size_t at = below(stream, text.size() + 1);
  const std::size_t length = below(stream, std::min<std::size_t>(text.size() - at, 64) + 1);
  switch (below(stream, 7)) {
    case 0:
      text.erase(at, length);
      break;
    case 1:
      text.insert(at, kPieces[below(stream, kPieces.size())]);
      break;
    case 2:
      text.replace(at, length, kPieces[below(stream, kPieces.size())]);
      break;
    case 3:
      if (at < text.size()) text[at] = static_cast<char>(stream.bits() & 0xFF);
      break;
    case 4:
      if (at < text.size()) text[at] = static_cast<char>(text[at] ^ (1 << below(stream, 8)));
      break;
    case 5:
      text.insert(at, text.substr(at, length));
      break;
    default: {
      const std::size_t from = below(stream, other.size() + 1);
      text = text.substr(0, at) + other.substr(from);
    }
  }
}

void run(const std::string& text) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

// A crash leaves the input behind, as libFuzzer does.
void run_and_keep(const std::string& text, const std::string& keep) {
  std::FILE* file = std::fopen(keep.c_str(), "wb");
  if (file != nullptr) {
    std::fwrite(text.data(), 1, text.size(), file);
    std::fclose(file);
  }
  run(text);
}

std::vector<std::string> read_corpus(int count, char** paths) {
  std::vector<std::string> files;
  for (int i = 0; i < count; ++i) {
    if (!std::filesystem::is_directory(paths[i])) {
      files.emplace_back(paths[i]);
      continue;
    }
    for (const auto& entry : std::filesystem::directory_iterator(paths[i])) {
      files.push_back(entry.path().string());
    }
  }
  std::sort(files.begin(), files.end());
  std::vector<std::string> texts;
  for (const std::string& file : files) {
    auto text = gapfarm::read_text_file(file);
    if (text.ok()) texts.push_back(*std::move(text));
  }
  return texts;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s MUTATIONS FILE_OR_FOLDER...\n", argv[0]);
    return 2;
  }
  const std::vector<std::string> corpus = read_corpus(argc - 2, argv + 2);
  if (corpus.empty()) {
    std::fprintf(stderr, "%s: the corpus is empty\n", argv[0]);
    return 1;
  }
  for (const std::string& text : corpus) run(text);
  const char* keep = std::getenv("GAPFARM_FUZZ_KEEP");  // a file for the input under test
  const unsigned long mutations = std::strtoul(argv[1], nullptr, 10);
  for (unsigned long i = 0; i < mutations; ++i) {
    gapfarm::Stream stream({i, gapfarm::Purpose::kTest, 0, 0, 0});
    std::string text = corpus[below(stream, corpus.size())];
    const std::size_t steps = 1 + below(stream, 6);
    for (std::size_t k = 0; k < steps; ++k) {
      mutate(text, corpus[below(stream, corpus.size())], stream);
    }
    if (keep != nullptr) {
      run_and_keep(text, keep);
    } else {
      run(text);
    }
  }
  std::printf("%zu files and %lu mutations of them\n", corpus.size(), mutations);
  return 0;
}
