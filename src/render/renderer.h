// States drawn by MuJoCo's renderer: the shapes of the model where the uniform state puts them, by the same code for
// every engine. No physics takes part.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/state.h"
#include "render/picture.h"
#include "store/scene.h"

namespace assay {

// From where a scene is seen.
struct View {
  Vec3 centre = Vec3::Zero();  // looked at, m
  double radius = 1;           // m: a sphere around the centre that fits into the picture
  double azimuth = 135;        // deg: direction of sight about z, from x
  double elevation = -20;      // deg: of the sight; negative looks down
};

// A view of everything in the runs: of each bound of each run's box the median, so that one run that flies apart does
// not make all others small. `runs` are states of the scene's model, at least one state in all.
View view_of(const Scene& scene, const std::vector<const std::vector<State>*>& runs);

// One panel: a state, or none, and lines of text over it.
struct Panel {
  const State* state = nullptr;
  std::string text;  // lines parted by '\n'
};

// The colour of pixels where there is nothing.
inline constexpr std::uint8_t kBackground = 240;

class Renderer {
 public:
  // Pictures of `width` x `height` pixels. `lettering` is 50, 100, 150, 200, 250 or 300, the size of the text in
  // percent. Throws SystemError where there is no OpenGL (gl.h) or it cannot draw pictures of this size.
  Renderer(const Scene& scene, const View& view, int width, int height, int lettering = 100);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  // The panels in a grid of `columns`, row by row from the top left, and a line of text at the bottom left of the
  // whole.
  Picture draw(const std::vector<Panel>& panels, int columns = 1, const std::string& caption = "");

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Columns of a grid of `panels` on a picture of that shape that leaves each of them the most room.
int grid_columns(int panels, int width, int height);

}  // namespace assay
