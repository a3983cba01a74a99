#include "load/text_edit.h"

#include <algorithm>
#include <cstddef>
#include <string_view>

#include <fmt/format.h>

#include "base/errors.h"

namespace assay {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

size_t start_of_line(const std::string& text, int line) {
  size_t at = 0;
  for (int i = 1; i < line && at != std::string::npos; ++i) {
    at = text.find('\n', at);
    if (at != std::string::npos) ++at;
  }
  return at;
}

// Where an attribute of the tag at `begin` stands, and its quotes; npos where it has none.
struct AttributePlace {
  size_t begin = std::string::npos, quote = 0, close = 0;
};

AttributePlace attribute_place(const std::string& text, size_t begin, const std::string& attribute) {
  const size_t end = tag_end(text, begin);
  for (size_t at = begin; (at = text.find(attribute, at)) < end; at += attribute.size()) {
    const size_t equals = text.find_first_not_of(kBlanks, at + attribute.size());
    if (kBlanks.find(text[at - 1]) == std::string_view::npos || text[equals] != '=') continue;
    const size_t quote = text.find_first_of("\"'", equals);
    return {at, quote, text.find(text[quote], quote + 1)};
  }
  return {};
}

void replace_attribute(std::string& text, size_t begin, const AttributeEdit& edit) {
  if (const auto [at, quote, close] = attribute_place(text, begin, edit.attribute); at != std::string::npos) {
    text.replace(quote + 1, close - quote - 1, edit.value);
  } else {
    text.insert(begin + 1 + edit.element.size(), fmt::format(" {}=\"{}\"", edit.attribute, edit.value));
  }
}

// Behind the element that begins at `begin`, with all that is in it.
size_t element_end(const std::string& text, size_t begin) {
  size_t depth = 0, at = begin;
  while (at < text.size()) {
    if (text.compare(at, 4, "<!--") == 0) {
      at = std::min(text.find("-->", at), text.size());
    } else {
      const size_t end = tag_end(text, at);
      if (text[at + 1] == '/') {
        --depth;
      } else if (text[end - 1] != '/' && text[at + 1] != '!' && text[at + 1] != '?') {
        ++depth;
      }
      if (depth == 0) return std::min(end + 1, text.size());
      at = end;
    }
    at = std::min(text.find('<', at), text.size());
  }
  return text.size();
}

}  // namespace

size_t element_begin(const std::string& text, int line, int index, const std::string& element) {
  constexpr std::string_view kComment = "<!--";
  const std::string head = "<" + element;
  size_t at = start_of_line(text, line);
  while (at != std::string::npos && (at = text.find('<', at)) != std::string::npos) {
    if (text.compare(at, kComment.size(), kComment) == 0) {
      at = text.find("-->", at);
      continue;
    }
    const size_t after = at + head.size();
    const bool is_it =
        text.compare(at, head.size(), head) == 0 && after < text.size() &&
        (kBlanks.find(text[after]) != std::string_view::npos || text[after] == '/' || text[after] == '>');
    if (is_it && index-- == 0) return at;
    ++at;
  }
  return std::string::npos;
}

size_t tag_end(const std::string& text, size_t begin) {
  for (size_t at = begin; (at = text.find_first_of("\"'>", at)) != std::string::npos; ++at) {
    if (text[at] == '>') return at;
    at = text.find(text[at], at + 1);
    if (at == std::string::npos) break;
  }
  return text.size();
}

std::string edited(std::string text, const std::vector<AttributeEdit>& edits) {
  for (const AttributeEdit& edit : edits) {
    const size_t begin = element_begin(text, edit.line, edit.index, edit.element);
    if (begin == std::string::npos) throw InputError(fmt::format("line {} has no <{}>", edit.line, edit.element));
    if (edit.attribute.empty()) {
      text.insert(tag_end(text, begin) + 1, edit.value);
    } else {
      replace_attribute(text, begin, edit);
    }
  }
  return text;
}

std::string without(std::string text, const AttributeEdit& part) {
  size_t begin = element_begin(text, part.line, part.index, part.element);
  if (begin == std::string::npos) return text;
  size_t end = 0;
  if (part.attribute.empty()) {
    end = element_end(text, begin);
  } else {
    const AttributePlace place = attribute_place(text, begin, part.attribute);
    if (place.begin == std::string::npos) return text;
    begin = place.begin;
    end = place.close + 1;
  }
  const auto lines = std::count(text.begin() + static_cast<std::ptrdiff_t>(begin),
                                text.begin() + static_cast<std::ptrdiff_t>(end), '\n');
  return text.replace(begin, end - begin, static_cast<size_t>(lines), '\n');
}

}  // namespace assay
