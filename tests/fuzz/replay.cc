// assay_fuzz_replay TARGET FOLDER [SECONDS]: every file of the folder through the target, as the fuzzer does it, and
// then for so long changes of them: always the same ones in the same order. Ends as the first finding ends it; that
// input is left in TARGET.input in the current folder.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <unistd.h>
#include <vector>

#include "targets.h"

namespace {

constexpr unsigned kMostSeconds = 30;     // for one input, on a machine that does other things too
constexpr std::size_t kLargest = 100000;  // bytes of a changed input
constexpr int kMostChanges = 8;

class Changes {
 public:
  explicit Changes(const std::vector<std::string>& inputs) : inputs_(inputs) {}

  std::string next() {
    std::string text = inputs_[below(inputs_.size())];
    for (std::size_t left = 1 + below(kMostChanges); left > 0; --left) change(text);
    if (text.size() > kLargest) text.resize(kLargest);
    return text;
  }

 private:
  // The engine's bits alone are the same with every standard library, a distribution's values are not.
  std::size_t below(std::size_t count) { return count == 0 ? 0 : chance_() % count; }

  void change(std::string& text) {
    static const std::vector<std::string> kWords = {
        "-1", "0", "1e308", "nan", "inf", "99999999999999999999", "%n", "\"",   "<",   ">",
        "[",  "]", "{",     "}",   ",",   std::string(1, '\0'),   "\n", "\xff", "../", "&#0;"};
    const std::size_t at = below(text.size() + 1), length = 1 + below(std::min<std::size_t>(64, text.size() + 1));
    switch (below(6)) {
      case 0:
        if (at < text.size()) text[at] = static_cast<char>(text[at] ^ (1 << below(8)));
        return;
      case 1:
        if (at < text.size()) text[at] = static_cast<char>(below(256));
        return;
      case 2:
        text.erase(at, length);
        return;
      case 3:
        text.insert(at, kWords[below(kWords.size())]);
        return;
      case 4:
        text.insert(at, text.substr(below(text.size() + 1), length));
        return;
      default: {  // as another one ends
        const std::string& other = inputs_[below(inputs_.size())];
        text = text.substr(0, at) + other.substr(below(other.size() + 1));
      }
    }
  }

  const std::vector<std::string>& inputs_;
  std::mt19937 chance_{1};  // NOLINT(bugprone-random-generator-seed): the same every time
};

void try_one(assay::fuzz::Target target, const std::string& bytes) {
  ::alarm(kMostSeconds);
  target(bytes);
  ::alarm(0);
}

}  // namespace

int main(int argc, char** argv) {
  const auto& all = assay::fuzz::targets();
  if (argc < 3 || argc > 4 || !all.contains(argv[1])) {
    std::fputs("assay_fuzz_replay TARGET FOLDER [SECONDS]\n", stderr);
    return 2;
  }
  const assay::fuzz::Target target = all.at(argv[1]);
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(argv[2])) files.push_back(entry.path());
  std::ranges::sort(files);
  std::vector<std::string> inputs;
  for (const auto& path : files) {
    std::fprintf(stderr, "%s\n", path.c_str());
    std::ifstream file(path, std::ios::binary);
    inputs.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    try_one(target, inputs.back());
  }
  if (inputs.empty()) return 1;
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::seconds(argc == 4 ? std::atoi(argv[3]) : 0);
  const std::string last = std::string(argv[1]) + ".input";
  Changes changes(inputs);
  std::size_t changed = 0;
  for (; Clock::now() < end; ++changed) {
    const std::string input = changes.next();
    std::ofstream(last, std::ios::binary) << input;
    try_one(target, input);
  }
  std::filesystem::remove(last);
  std::printf("%zu files, %zu changes of them\n", inputs.size(), changed);
  return 0;
}
