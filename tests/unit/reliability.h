// Lines of docs/lab/reliability.md, which tests write when ASSAY_RELIABILITY names a folder (docs/update.py
// reliability).
#pragma once

#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

namespace assay {

// What was done to the program, how often in this test, how it ended, and what was lost. Nothing is written by a test
// that has failed.
inline void reliability(const std::string& fault, int tries, const std::string& outcome, const std::string& lost) {
  const char* folder = std::getenv("ASSAY_RELIABILITY");
  if (folder == nullptr || ::testing::Test::HasFailure()) return;
  std::string name;
  for (const char c : fault) name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '-';
  const auto quoted = [](const std::string& text) {
    std::string out = "\"";
    for (const char c : text) {
      if (c == '"' || c == '\\') out += '\\';
      out += c;
    }
    return out + "\"";
  };
  std::filesystem::create_directories(folder);
  std::ofstream file(std::filesystem::path(folder) / (name + ".json"));
  file << "{\"fault\": " << quoted(fault) << ", \"tries\": " << tries << ", \"outcome\": " << quoted(outcome)
       << ", \"lost\": " << quoted(lost) << "}\n";
}

}  // namespace assay
