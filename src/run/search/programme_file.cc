#include "run/search/programme_file.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "base/write_file.h"
#include "campaign/campaign.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

fs::path canonical_path(const std::string& path) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(fs::absolute(path, error), error);
  if (error) throw InputError(fmt::format("'{}' cannot be a path ({}): give another", path, error.message()));
  return whole;
}

// Whether the programme `now` is that of `before` with contenders of further engines.
bool only_adds_contenders(const std::string& before, const std::string& now, const std::string& file) {
  const auto rest = [](const std::string& toml) {
    std::vector<std::string> lines;
    std::istringstream text(toml);
    for (std::string line; std::getline(text, line);) {
      if (!line.starts_with('#') && !line.starts_with("contenders = ")) lines.push_back(line);
    }
    return lines;
  };
  if (before == now || rest(before) != rest(now)) return false;
  const auto names = [&](const std::string& toml) {
    std::set<std::string> found;
    for (const CampaignContender& each : parse_campaign(toml, file).contenders) found.insert(each.resolved.name);
    return found;
  };
  try {
    const std::set<std::string> old = names(before), all = names(now);
    return old.size() < all.size() && std::ranges::includes(all, old);
  } catch (const InputError&) {
    return false;  // has_programme() says what is wrong with it
  }
}

// Whether the programme is there already, word for word. Throws InputError for another one.
bool has_programme(const std::string& dir, const std::string& file, const Programme& programme,
                   const std::function<void(const std::string&)>& tell) {
  std::error_code error;
  if (!fs::exists(file, error)) return false;
  const std::string there = campaign_text(file);
  if (there == programme.toml) return true;
  // Earlier versions did not write it as a whole: a kill or a full disk left its beginning.
  if (programme.toml.starts_with(there) && !fs::exists(dir + "/assay.sqlite", error)) {
    tell(fmt::format("'{}' is only the beginning of the programme, and nothing was measured yet: it is written anew",
                     file));
    return false;
  }
  if (only_adds_contenders(there, programme.toml, file)) {
    tell(fmt::format("'{}': engines that were set up since take part, too", file));
    return false;
  }
  std::string hash;
  try {
    hash = parse_campaign(there, file).hash();
  } catch (const InputError& why) {
    throw InputError(fmt::format("{}; remove the file, or give another folder with --out", why.what()));
  }
  if (hash == parse_campaign(programme.toml, file).hash()) return false;
  throw InputError(
      fmt::format("'{}' is another programme: give another folder with --out, or go on with 'assay run "
                  "{} --out {}'",
                  file, file, dir));
}

}  // namespace

std::string relative_path(const std::string& file, const std::string& dir) {
  const std::string path = canonical_path(file).lexically_relative(canonical_path(dir)).string();
  return path.find('/') == std::string::npos ? "./" + path : path;
}

std::string write_programme(const std::string& dir, const Programme& programme,
                            const std::function<void(const std::string&)>& tell) {
  const std::string file = (fs::path(dir) / "campaign.toml").string();
  if (has_programme(dir, file, programme, tell)) return file;
  std::error_code error;
  fs::create_directories(dir, error);
  if (error) throw SystemError(fmt::format("cannot make the directory '{}': {}", dir, error.message()));
  write_file(file, programme.toml);
  return file;
}

}  // namespace assay
