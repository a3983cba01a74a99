// How messages name contact pairs: each by its shapes, and in a model of many pairs those of two kinds of shapes
// together.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

// Pairs that something is said about, in a model with more than kMostNamed pairs grouped.
class PairGroups {
 public:
  static constexpr size_t kMostNamed = 500;

  explicit PairGroups(const Model& model) : model_(model), named_(model.contacts.size() <= kMostNamed) {}

  // `detail` follows on the name, and pairs of another one are another group: ", friction 0.001".
  void add(const ContactPair& pair, const std::string& detail = {});

  // In the order of their first pairs: "contact of 'a' and 'b'", "contacts of 'a' and 'b' and 41 more pairs of boxes
  // and capsules".
  std::vector<std::string> elements() const;

 private:
  static constexpr size_t kKinds = 8;  // of shapes
  struct Group {
    const ContactPair* first = nullptr;
    size_t count = 0;
    std::string detail = {};
  };
  size_t new_group(const ContactPair& pair, const std::string& detail);

  const Model& model_;
  bool named_;
  std::vector<Group> groups_;
  std::array<size_t, kKinds * kKinds> plain_ = {};           // number of the group without a detail, from 1 on
  std::map<std::pair<size_t, std::string>, size_t> others_;  // and with one
};

// How many pairs an element of PairGroups stands for; 1 for every other element.
size_t pairs_in(const std::string& element);

}  // namespace assay
