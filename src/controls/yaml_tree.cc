#include "controls/yaml_tree.h"

#include <algorithm>
#include <array>
#include <set>

#include <fmt/format.h>
#include <yaml.h>

#include "base/errors.h"

namespace assay {
namespace {

constexpr std::string_view kStandardTag = "tag:yaml.org,2002:";

// libyaml's time grows with the square of the depth; configurations have a dozen levels.
constexpr int kMostLevels = 100;

class Parser {
 public:
  explicit Parser(std::string_view text) {
    if (yaml_parser_initialize(&parser_) == 0) throw SystemError("libyaml has no memory for a parser");
    yaml_parser_set_input_string(&parser_, reinterpret_cast<const unsigned char*>(text.data()), text.size());
  }
  ~Parser() {
    if (loaded_) yaml_document_delete(&document_);
    yaml_parser_delete(&parser_);
  }
  Parser(const Parser&) = delete;
  Parser& operator=(const Parser&) = delete;

  yaml_document_t& load(const std::string& path) {
    loaded_ = yaml_parser_load(&parser_, &document_) != 0;
    if (!loaded_) {
      throw InputError(fmt::format("{}:{}: this is no YAML: {}", path, line(parser_.problem_mark),
                                   parser_.problem != nullptr ? parser_.problem : "out of memory"));
    }
    return document_;
  }
  // Throws for what is nested deeper than kMostLevels. Where the text is no YAML, load() says so.
  void refuse_deep(const std::string& path) {
    int level = 0;
    yaml_event_type_t type = YAML_NO_EVENT;
    while (type != YAML_STREAM_END_EVENT) {
      yaml_event_t event;
      if (yaml_parser_parse(&parser_, &event) == 0) return;
      type = event.type;
      const int at = line(event.start_mark);
      yaml_event_delete(&event);
      if (type == YAML_SEQUENCE_START_EVENT || type == YAML_MAPPING_START_EVENT) ++level;
      if (type == YAML_SEQUENCE_END_EVENT || type == YAML_MAPPING_END_EVENT) --level;
      if (level > kMostLevels) {
        throw InputError(fmt::format("{}:{}: lists and maps are nested deeper than {} levels", path, at, kMostLevels));
      }
    }
  }
  static int line(const yaml_mark_t& mark) { return static_cast<int>(mark.line) + 1; }

 private:
  yaml_parser_t parser_{};
  yaml_document_t document_{};
  bool loaded_ = false;
};

std::string text_of(const yaml_char_t* text, size_t size) { return {reinterpret_cast<const char*>(text), size}; }

std::string tag_of(const yaml_node_t& node) {
  const std::string_view tag = node.tag != nullptr ? reinterpret_cast<const char*>(node.tag) : "";
  constexpr std::array<std::string_view, 3> kDefault = {YAML_DEFAULT_SCALAR_TAG, YAML_DEFAULT_SEQUENCE_TAG,
                                                        YAML_DEFAULT_MAPPING_TAG};
  if (std::ranges::find(kDefault, tag) != kDefault.end()) return "";
  return std::string(tag.starts_with(kStandardTag) ? tag.substr(kStandardTag.size()) : tag);
}

}  // namespace

bool YamlNode::is_null() const {
  return kind == Kind::kScalar && !quoted && (text.empty() || text == "null" || text == "~" || text == "Null");
}

const YamlNode* YamlNode::find(std::string_view key) const {
  const auto found = std::ranges::find(entries, key, &std::pair<std::string, const YamlNode*>::first);
  return found == entries.end() ? nullptr : found->second;
}

YamlTree YamlTree::parse(std::string_view text, const std::string& path) {
  Parser(text).refuse_deep(path);
  Parser parser(text);
  const yaml_document_t& document = parser.load(path);
  const auto count = static_cast<size_t>(document.nodes.top - document.nodes.start);
  if (count == 0) throw InputError(fmt::format("'{}' has no YAML document: it is empty", path));
  YamlTree tree;
  tree.nodes_.resize(count);  // the root comes first
  const auto at = [&](int index) { return &tree.nodes_[static_cast<size_t>(index) - 1]; };
  for (size_t i = 0; i < count; ++i) {
    const yaml_node_t& from = document.nodes.start[i];
    YamlNode& node = tree.nodes_[i];
    node.line = Parser::line(from.start_mark);
    node.tag = tag_of(from);
    if (from.type == YAML_SCALAR_NODE) {
      node.text = text_of(from.data.scalar.value, from.data.scalar.length);
      node.quoted = from.data.scalar.style != YAML_PLAIN_SCALAR_STYLE;
    } else if (from.type == YAML_SEQUENCE_NODE) {
      node.kind = YamlNode::Kind::kList;
      for (const int* item = from.data.sequence.items.start; item < from.data.sequence.items.top; ++item) {
        node.items.push_back(at(*item));
      }
    } else {
      node.kind = YamlNode::Kind::kMap;
      std::set<std::string> keys;
      for (const yaml_node_pair_t* pair = from.data.mapping.pairs.start; pair < from.data.mapping.pairs.top; ++pair) {
        const yaml_node_t& key = document.nodes.start[pair->key - 1];
        if (key.type != YAML_SCALAR_NODE) {
          throw InputError(fmt::format("{}:{}: a key is a list or a map: assay reads keys that are texts", path,
                                       Parser::line(key.start_mark)));
        }
        const std::string name = text_of(key.data.scalar.value, key.data.scalar.length);
        if (!keys.insert(name).second) {
          throw InputError(fmt::format("{}:{}: the key '{}' is there twice: leave one out", path,
                                       Parser::line(key.start_mark), name));
        }
        node.entries.emplace_back(name, at(pair->value));
      }
    }
  }
  return tree;
}

}  // namespace assay
