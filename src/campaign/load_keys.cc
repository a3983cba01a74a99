#include "campaign/load_keys.h"

#include <array>

#include <fmt/format.h>

#include "base/external_files.h"
#include "base/text.h"
#include "controls/toml_text.h"

namespace assay {
namespace {

void read_folders(const Section& section, const char* key, Folders& folders) {
  const toml::node* node = section.find(key);
  if (node == nullptr) return;
  const toml::table* table = node->as_table();
  if (table == nullptr) {
    section.fail(node, fmt::format("'{}' is {}: give {{name = \"folder\"}}", key, node_text(*node)));
  }
  for (const auto& [name, folder] : *table) {
    const auto path = folder.value_exact<std::string>();
    if (!path) section.fail(&folder, fmt::format("'{}' has {}: give a folder", key, node_text(folder)));
    folders.emplace(name.str(), section.path_from(*path));
  }
}

// The number of the choice whose key is true, 0 for none.
int chosen(const Section& section, const std::array<LoadChoice, 2>& choices) {
  const bool first = section.flag(choices[0].key, false), second = section.flag(choices[1].key, false);
  if (first && second) {
    section.fail(section.find(choices[0].key),
                 fmt::format("'{}' and '{}' contradict each other", choices[0].key, choices[1].key));
  }
  return first ? 1 : 2 * static_cast<int>(second);
}

}  // namespace

std::vector<std::string> load_key_names() {
  std::vector<std::string> names;
  const LoadOptions options;
  visit_load_fields(options, [&]<typename T>(const LoadField& field, const T&) {
    if constexpr (std::is_enum_v<T>) {
      for (const LoadChoice& each : field.choices) names.emplace_back(each.key);
    } else {
      names.emplace_back(field.key);
    }
  });
  return names;
}

LoadOptions load_options_of(const Section& section) {
  LoadOptions load;
  visit_load_fields(load,
                    Overloaded{[&](const LoadField& field, bool& value) { value = section.flag(field.key, false); },
                               [&](const LoadField& field, std::string& value) {
                                 value = section.text(field.key).value_or("");
                                 if (field.is_path() && !value.empty()) value = section.path_from(value);
                               },
                               [&](const LoadField& field, Folders& value) { read_folders(section, field.key, value); },
                               [&]<typename Choice>(const LoadField& field, Choice& value) {
                                 value = static_cast<Choice>(chosen(section, field.choices));
                               }});
  if (load.allow_external_files && !agreed_to_external_files()) {
    section.fail(
        section.find("allow_external_files"),
        "'allow_external_files' lets models read files from outside their folders: look at what they name, and "
        "then give --allow-external-files");
  }
  return load;
}

std::vector<std::string> load_lines(const LoadOptions& load,
                                    const std::function<std::string(const std::string&)>& place) {
  std::vector<std::string> lines, tables;
  visit_load_fields(
      load, Overloaded{[&](const LoadField& field, const bool& value) {
                         if (value) lines.push_back(fmt::format("{} = true", field.key));
                       },
                       [&](const LoadField& field, const std::string& value) {
                         if (value.empty()) return;
                         lines.push_back(
                             fmt::format("{} = {}", field.key, toml_text(field.is_path() ? place(value) : value)));
                       },
                       [&](const LoadField& field, const Folders& value) {
                         std::vector<std::string> entries;
                         entries.reserve(value.size());
                         for (const auto& [name, folder] : value) {
                           entries.push_back(fmt::format("{} = {}", toml_text(name), toml_text(place(folder))));
                         }
                         if (entries.empty()) return;
                         tables.push_back(fmt::format("{} = {{{}}}", field.key, join(entries, ", ")));
                       },
                       [&]<typename Choice>(const LoadField& field, const Choice& value) {
                         if (is_load_default(value)) return;
                         const LoadChoice& choice = field.choices.at(static_cast<size_t>(value) - 1);
                         lines.push_back(fmt::format("{} = true", choice.key));
                       }});
  lines.insert(lines.end(), tables.begin(), tables.end());
  return lines;
}

}  // namespace assay
