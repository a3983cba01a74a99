// The program's glossary is the table of terms in docs/methodology.md.
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "results/values.h"

namespace assay {
namespace {

TEST(Glossary, IsThatOfTheDocument) {
  std::ifstream file(std::string(ASSAY_MODELS) + "/../docs/methodology.md");
  std::vector<std::string> written;
  bool within = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("<!-- terms: ")) within = line == "<!-- terms: begin -->";
    if (!within || !line.starts_with("| ") || line.starts_with("| ---") || line == "| term | meaning |") continue;
    std::erase(line, '`');
    written.push_back(line);
  }
  std::vector<std::string> known;
  for (const auto& [term, meaning] : glossary()) known.push_back(fmt::format("| {} | {} |", term, meaning));
  EXPECT_GT(known.size(), 20U);
  EXPECT_EQ(known, written);
}

}  // namespace
}  // namespace assay
