#include "cli/model_options.h"

#include <algorithm>
#include <filesystem>
#include <string_view>

#include <fmt/format.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/external_files.h"
#include "base/paths.h"
#include "load/mjcf.h"

namespace assay::cli {
namespace {

namespace fs = std::filesystem;

std::string option_name(std::string_view key) {
  std::string name = "--" + std::string(key);
  std::ranges::replace(name, '_', '-');
  return name;
}
std::string option_name(const LoadField& field) {
  return option_name(field.option != nullptr ? field.option : field.key);
}

void refuse_both(const std::string& first, const std::string& second) {
  throw InputError(fmt::format("{} and {} contradict each other: give one of them", first, second));
}

void read_folders(const std::string& option, const std::vector<std::string>& given, Folders& folders) {
  for (const std::string& text : given) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
      throw InputError(fmt::format("{0} is '{1}': write it as NAME=DIR, as in {0} my_robot=~/my_robot", option, text));
    }
    const std::string name = text.substr(0, equals), folder = text.substr(equals + 1);
    if (std::error_code error; !fs::is_directory(folder, error)) {
      throw InputError(fmt::format("{} {}: there is no folder '{}'; check the path", option, name, folder));
    }
    if (!folders.emplace(name, folder).second) {
      throw InputError(fmt::format("{} names '{}' twice: keep one of them", option, name));
    }
  }
}

}  // namespace

void add_load_options(CLI::App& command, ModelOptions& options, Repair repair) {
  const auto flag = [&](const char* key, bool& value, const char* meaning) {
    command.add_flag(option_name(key), value, meaning)->disable_flag_override()->group(kModelGroup);
  };
  const auto option = [&](const LoadField& field, auto& value) {
    return command.add_option(option_name(field), value, field.meaning)->group(kModelGroup)->type_name(field.value);
  };
  visit_load_fields(options.load, Overloaded{[&](const LoadField& field, bool& value) {
                                               const bool own =
                                                   repair == Repair::kOwn && &value == &options.load.repair;
                                               if (!own) flag(field.key, value, field.meaning);
                                             },
                                             [&](const LoadField& field, std::string& value) { option(field, value); },
                                             [&](const LoadField& field, Folders&) {
                                               option(field, options.packages[field.key])->allow_extra_args(false);
                                             },
                                             [&](const LoadField& field, auto&) {
                                               for (const LoadChoice& each : field.choices)
                                                 flag(each.key, options.choices[each.key], each.meaning);
                                             }});
}

void add_model_options(CLI::App& command, ModelOptions& options, Repair repair) {
  command.add_option("MODEL", options.model, "MJCF, URDF or USD file, or a system's name")->required()->type_name("");
  add_load_options(command, options, repair);
}

LoadOptions load_options(const ModelOptions& options) {
  LoadOptions load = options.load;
  visit_load_fields(load, Overloaded{[](const LoadField&, bool&) {}, [](const LoadField&, std::string&) {},
                                     [&](const LoadField& field, Folders& folders) {
                                       const auto given = options.packages.find(field.key);
                                       if (given == options.packages.end()) return;
                                       read_folders(option_name(field), given->second, folders);
                                     },
                                     [&]<typename Choice>(const LoadField& field, Choice& value) {
                                       int number = 0;
                                       for (const LoadChoice& each : field.choices) {
                                         ++number;
                                         const auto given = options.choices.find(each.key);
                                         if (given == options.choices.end() || !given->second) continue;
                                         if (!is_load_default(value)) {
                                           refuse_both(option_name(field.choices[0].key), option_name(each.key));
                                         }
                                         value = static_cast<Choice>(number);
                                       }
                                     }});
  if (!load.keyframe.empty() && !load.qpos.empty()) refuse_both("--keyframe", "--qpos");
  if (load.allow_external_files) agree_to_external_files();
  return load;
}

Model load(const ModelOptions& options) {
  const LoadOptions how = load_options(options);
  return load_model(find_model(options.model), how);
}

}  // namespace assay::cli
