#include "report/parity.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/regular_file.h"

namespace assay {

using nlohmann::json;
namespace fs = std::filesystem;

std::string parity_file(const std::string& dir, const std::string& model) {
  std::string name = model;
  std::ranges::replace_if(name, [](char c) { return c == '/' || static_cast<unsigned char>(c) < ' '; }, '_');
  if (name.empty() || name.starts_with('.')) name = "_" + name;
  return (fs::path(dir) / "parity" / (name + ".json")).string();
}

json parity_data(const std::string& dir) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(fs::path(dir) / "parity", error)) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  json certificates = json::array();
  constexpr std::uintmax_t kMostBytes = 16 << 20;  // of all; as JSON they take up to 40 times as much
  std::uintmax_t left = kMostBytes;
  for (const fs::path& file : files) {
    const RegularFile certificate(file);
    std::string text;
    if (certificate.error() != 0 || !certificate.other().empty()) continue;
    if (certificate.read(text, left + 1) != 0) continue;
    if (text.size() > left) {
      throw InputError(
          fmt::format("the certificates of parity up to '{}' have more than {} MiB together, and at most that is read: "
                      "remove those that are not of these results",
                      file.string(), kMostBytes >> 20));
    }
    left -= text.size();
    json parsed = json::parse(text, nullptr, /*allow_exceptions=*/false);
    if (parsed.is_object() && (parsed.contains("certificates") || parsed.contains("differences")))
      certificates.push_back(std::move(parsed));
  }
  return certificates;
}

}  // namespace assay
