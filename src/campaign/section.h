// Tables of a campaign's file.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toml++/toml.h>

#include "base/errors.h"
#include "campaign/campaign.h"

namespace assay {

// The names of all measures that campaigns can ask for.
std::vector<std::string> measure_names();

// One value of an engine's setting as in `--set`; nothing where the node is a list, a table or a date.
std::optional<std::string> setting_value_text(const toml::node& node);

// A value as messages show it.
std::string node_text(const toml::node& node);

// One table of the file. Its messages say where the error is. Refers to the table and to the file's
// name, which have to outlive it. Everything throws InputError with file and line.
class Section {
 public:
  // `what` names the table in messages: "[[system]]".
  Section(const toml::table& table, std::string what, const std::string& source)
      : table_(table), what_(std::move(what)), source_(source) {}

  // Names the line of the node, or of the table when there is no node.
  [[noreturn]] void fail(const toml::node* node, const std::string& sentence) const;

  // Throws for a key that is none of `known`: nothing in the file is ignored.
  void allow(const std::vector<std::string>& known) const;

  const toml::node* find(std::string_view key) const { return table_.get(key); }

  std::optional<std::string> text(std::string_view key) const;
  std::string required_text(std::string_view key) const;
  bool flag(std::string_view key, bool otherwise) const;
  double positive(std::string_view key, double otherwise) const;
  double positive(std::string_view key, const toml::node& node) const;
  int count(std::string_view key, int otherwise, int least, int most) const;
  const toml::array& list(std::string_view key, const toml::node& node) const;
  // Ascending, without repetitions.
  std::optional<std::vector<double>> timesteps(std::string_view key) const;
  std::optional<std::vector<const Measure*>> measures(std::string_view key) const;

  // Every [[key]] in the file.
  std::vector<Section> sections(std::string_view key) const;

  const std::string& source() const { return source_; }
  // A path in the file, which counts from the file's folder.
  std::string path_from(const std::string& path) const;

 private:
  const toml::table& table_;
  std::string what_;
  const std::string& source_;
};

// Adds file and line to the message of an InputError.
template <typename Work>
auto at_node(const Section& section, const toml::node* node, Work work) {
  try {
    return work();
  } catch (const InputError& error) {
    section.fail(node, error.what());
  }
}

}  // namespace assay
