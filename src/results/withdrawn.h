// Cells that do not count until they are measured again, because the adapter or the engine's use was wrong when they
// were measured: results/withdrawn.toml, which is part of the program.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "results/store/store.h"

namespace assay {

struct Withdrawal {
  std::vector<std::string> contenders, except;  // patterns
  std::string where;                            // which systems: "contacts", "contacts of joined bodies", "rest"
  std::vector<std::string> measures;            // patterns; empty: all
  std::vector<std::string> except_models;
  double before = 0;  // seconds since 1970: cells that began earlier
  std::string why;
};

// Throws InputError with the line for what is no such list.
std::vector<Withdrawal> parse_withdrawals(std::string_view text, const std::string& source);

// The program's own list.
const std::vector<Withdrawal>& withdrawals();

// Why the cell of a system with these facts does not count; "" where it does.
std::string why_withdrawn(const std::vector<Withdrawal>& list, const Cell& cell, const nlohmann::json& facts);

}  // namespace assay
