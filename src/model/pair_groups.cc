#include "model/pair_groups.h"

#include <algorithm>
#include <charconv>
#include <string_view>

#include <fmt/format.h>

#include "model/shape.h"

namespace assay {
namespace {

constexpr std::string_view kMore = "' and ", kMorePairs = " more pairs of ";

}  // namespace

void PairGroups::add(const ContactPair& pair, const std::string& detail) {
  if (named_) {
    new_group(pair, detail);
    return;
  }
  const auto kind_of = [&](int shape) { return static_cast<size_t>(model_.shapes[static_cast<size_t>(shape)].type); };
  const auto [a, b] = std::minmax({kind_of(pair.shape_a), kind_of(pair.shape_b)});
  const size_t kinds = a * kKinds + b;
  size_t& number = detail.empty() ? plain_.at(kinds) : others_[{kinds, detail}];
  if (number == 0) number = new_group(pair, detail);
  ++groups_[number - 1].count;
}

size_t PairGroups::new_group(const ContactPair& pair, const std::string& detail) {
  groups_.push_back({.first = &pair, .count = 0, .detail = detail});
  return groups_.size();
}

std::vector<std::string> PairGroups::elements() const {
  std::vector<std::string> elements;
  elements.reserve(groups_.size());
  for (const Group& group : groups_) {
    const Shape& a = model_.shapes[static_cast<size_t>(group.first->shape_a)];
    const Shape& b = model_.shapes[static_cast<size_t>(group.first->shape_b)];
    std::string element = fmt::format("{} of '{}' and '{}'", group.count > 1 ? "contacts" : "contact", a.name, b.name);
    if (group.count > 1) {
      element += fmt::format(" and {}{}{}", group.count - 1, kMorePairs, shapes_text(a.type));
      if (a.type != b.type) element += fmt::format(" and {}", shapes_text(b.type));
    }
    elements.push_back(element + group.detail);
  }
  return elements;
}

size_t pairs_in(const std::string& element) {
  const size_t at = element.rfind(kMorePairs), from = element.rfind(kMore, at);
  if (!element.starts_with("contacts of '") || at == std::string::npos || from == std::string::npos) return 1;
  size_t more = 0;
  const char* end = element.data() + at;
  const auto read = std::from_chars(element.data() + from + kMore.size(), end, more);
  return read.ptr == end ? more + 1 : 1;
}

}  // namespace assay
