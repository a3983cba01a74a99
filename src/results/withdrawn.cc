#include "results/withdrawn.h"

#include <algorithm>
#include <chrono>

#include <fmt/format.h>
#include <fnmatch.h>

#include "base/errors.h"
#include "base/text.h"
#include "base/toml_file.h"
#include "results/store/facts.h"

namespace assay {
namespace {

constexpr std::string_view kOwnList =
#include "withdrawn.inc"
    ;

const std::vector<std::string> kPlaces = {"contacts", "contacts of joined bodies", "rest"};

bool is_any(const std::string& name, const std::vector<std::string>& patterns) {
  return std::ranges::any_of(patterns, [&](const std::string& pattern) {
    return ::fnmatch(pattern.c_str(), name.c_str(), FNM_NOESCAPE) == 0;
  });
}

bool has_gravity(const nlohmann::json& facts) {
  const auto found = facts.find("gravity");
  if (found == facts.end() || !found->is_array()) return true;
  return std::ranges::any_of(*found, [](const nlohmann::json& part) { return part.is_number() && part != 0; });
}

bool is_where(const std::string& where, const nlohmann::json& facts) {
  const auto contacts = facts.find("contacts");
  if (contacts != facts.end() && *contacts == false) return false;
  if (!(number_fact(facts, "contact_pairs") > 0)) return false;
  if (where == "contacts of joined bodies") return number_fact(facts, "hinges") > 0;
  // six degrees of freedom that no hinge or slide has
  if (where == "rest") return number_fact(facts, "dof") - number_fact(facts, "hinges") >= 6 && has_gravity(facts);
  return true;
}

double seconds_of(const toml::date_time& time) {
  using std::chrono::sys_days;
  const std::chrono::year_month_day day{std::chrono::year{time.date.year}, std::chrono::month{time.date.month},
                                        std::chrono::day{time.date.day}};
  const auto days = std::chrono::duration<double>(sys_days{day}.time_since_epoch()).count();
  return days + 3600.0 * time.time.hour + 60.0 * time.time.minute + time.time.second -
         60.0 * (time.offset ? time.offset->minutes : 0);
}

Withdrawal withdrawal_of(const toml::table& table, const std::string& source) {
  const auto fail = [&](const std::string& sentence) {
    throw InputError(fmt::format("{}:{}: {}", source, table.source().begin.line, sentence));
  };
  const auto texts = [&](const char* key) {
    std::vector<std::string> found;
    const toml::array* list = table[key].as_array();
    if (list == nullptr) return found;
    for (const toml::node& each : *list) found.push_back(each.value_or(std::string()));
    return found;
  };
  Withdrawal withdrawal{texts("contenders"),
                        texts("except"),
                        table["where"].value_or(std::string()),
                        texts("measures"),
                        texts("except_models"),
                        0,
                        table["why"].value_or(std::string())};
  if (withdrawal.contenders.empty()) fail("name patterns of 'contenders'");
  if (std::ranges::find(kPlaces, withdrawal.where) == kPlaces.end()) {
    fail(fmt::format("'where' is '{}': use {}", withdrawal.where, join(kPlaces, ", ")));
  }
  if (withdrawal.why.empty()) fail("say in 'why' what was wrong");
  const toml::value<toml::date_time>* before = table["before"].as_date_time();
  if (before == nullptr) fail("give the time 'before' which cells were wrong, as in 2026-11-26T12:00:00Z");
  withdrawal.before = seconds_of(before->get());
  return withdrawal;
}

}  // namespace

std::vector<Withdrawal> parse_withdrawals(std::string_view text, const std::string& source) {
  std::vector<Withdrawal> list;
  const toml::table file = toml_table(text, source);
  const toml::array* entries = file["withdrawn"].as_array();
  if (entries == nullptr) return list;
  for (const toml::node& entry : *entries) {
    if (entry.is_table()) list.push_back(withdrawal_of(*entry.as_table(), source));
  }
  return list;
}

const std::vector<Withdrawal>& withdrawals() {
  static const std::vector<Withdrawal> kList = parse_withdrawals(kOwnList, "results/withdrawn.toml");
  return kList;
}

std::string why_withdrawn(const std::vector<Withdrawal>& list, const Cell& cell, const nlohmann::json& facts) {
  for (const Withdrawal& each : list) {
    if (!(cell.started > 0) || cell.started >= each.before) continue;
    if (!is_any(cell.contender, each.contenders) || is_any(cell.contender, each.except)) continue;
    if (!each.measures.empty() && !is_any(cell.measure, each.measures)) continue;
    if (is_any(text_fact(facts, "model"), each.except_models)) continue;
    if (is_where(each.where, facts)) return each.why;
  }
  return "";
}

}  // namespace assay
