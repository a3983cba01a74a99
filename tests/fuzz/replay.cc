// assay_fuzz_replay TARGET FOLDER: every file of the folder through the target, as the fuzzer does it. Ends as the
// first finding ends it.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <unistd.h>
#include <vector>

#include "targets.h"

int main(int argc, char** argv) {
  constexpr unsigned kMostSeconds = 30;  // for one file, on a machine that does other things too
  const auto& all = assay::fuzz::targets();
  if (argc != 3 || !all.contains(argv[1])) {
    std::fputs("assay_fuzz_replay TARGET FOLDER\n", stderr);
    return 2;
  }
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(argv[2])) files.push_back(entry.path());
  std::ranges::sort(files);
  for (const auto& path : files) {
    std::fprintf(stderr, "%s\n", path.c_str());
    std::ifstream file(path, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    ::alarm(kMostSeconds);
    all.at(argv[1])(bytes);
    ::alarm(0);
  }
  std::printf("%zu files\n", files.size());
  return files.empty() ? 1 : 0;
}
