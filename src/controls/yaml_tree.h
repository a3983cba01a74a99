// A YAML document as a tree of scalars, lists and maps with their lines, by libyaml.
//
// No tag is obeyed and nothing is constructed: `!!python/tuple [1, 2]` is a list whose tag says so. An alias is the
// node of its anchor itself, so that a tree is never larger than its text; it can have cycles.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace assay {

struct YamlNode {
  enum class Kind { kScalar, kList, kMap };
  Kind kind = Kind::kScalar;
  int line = 0;                        // in the file, from 1
  std::string tag;                     // without "tag:yaml.org,2002:"; "" where the file gives none
  std::string text;                    // of a scalar
  bool quoted = false;                 // a scalar that cannot be a number or null
  std::vector<const YamlNode*> items;  // of a list
  std::vector<std::pair<std::string, const YamlNode*>> entries;  // of a map, in the file's order

  bool is_null() const;
  // The value of a key of a map; null pointer where there is none.
  const YamlNode* find(std::string_view key) const;
};

class YamlTree {
 public:
  // The first document of `text`; `path` is for messages. Throws InputError with the line for a text that is no YAML,
  // has no document, is nested deeper than 100 levels, or has a map with a key twice or with a key that is no scalar.
  static YamlTree parse(std::string_view text, const std::string& path);
  const YamlNode& root() const { return nodes_.front(); }

 private:
  std::vector<YamlNode> nodes_;  // never resized after parse(): nodes point at each other
};

}  // namespace assay
