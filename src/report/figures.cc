#include "report/figures.h"

#include <array>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "base/write_file.h"
#include "report/canvas.h"
#include "report/figures/axes.h"
#include "report/figures/drawing.h"
#include "results/results.h"

namespace assay {

std::vector<std::string> write_figures(const Store& store, const std::string& folder) {
  // after the last canvas
  struct Fonts {
    Fonts() { find_fonts(); }
    Fonts(const Fonts&) = delete;
    Fonts& operator=(const Fonts&) = delete;
    ~Fonts() { forget_fonts(); }
  };
  const Fonts fonts;
  const Results results(store);
  const std::array drawings = {
      std::pair{"figure3", figures::figure3(results)}, std::pair{"figure4", figures::figure4(results)},
      std::pair{"figure5", figures::figure5(results)}, std::pair{"grasp-table", figures::grasp_table(results)}};
  std::vector<std::string> files;
  for (const auto& [name, drawing] : drawings) {
    if (!drawing) continue;
    for (const auto& [format, ending] : {std::pair{Format::kSvg, "svg"}, std::pair{Format::kPdf, "pdf"}}) {
      make_own_folder(folder);
      Canvas canvas(format, figures::kWidth, drawing->height);
      canvas.fill_rectangle(0, 0, figures::kWidth, drawing->height, {1, 1, 1});
      drawing->draw(canvas);
      const std::string file = (std::filesystem::path(folder) / fmt::format("{}.{}", name, ending)).string();
      write_file(file, canvas.finish());
      files.push_back(file);
    }
  }
  return files;
}

}  // namespace assay
