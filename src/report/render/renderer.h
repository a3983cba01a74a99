// Draws states with MuJoCo's renderer: the model's shapes at the poses of the uniform state, by the same code for every
// engine. No physics is computed.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/state.h"
#include "report/render/picture.h"
#include "results/store/scene.h"

namespace assay {

// The camera of a scene.
struct View {
  Vec3 centre = Vec3::Zero();  // point that the camera looks at, m
  double radius = 1;           // m: a sphere around the centre that fits into the picture
  double azimuth = 135;        // deg: viewing direction about z, from x
  double elevation = -20;      // deg: of the viewing direction; negative looks down
};

// A view of all runs: each bound is the median over the runs' bounding boxes, so that one run that flies apart does not
// make the others small. `runs` are states of the scene's model, at least one state in all.
View view_of(const Scene& scene, const std::vector<const std::vector<State>*>& runs);

// One panel: a state, or none, and lines of text over it.
struct Panel {
  const State* state = nullptr;
  std::string text;  // lines separated by '\n'
};

// The background colour.
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

// Number of columns that gives each of `panels` panels the most room on a picture of this shape.
int grid_columns(int panels, int width, int height);

}  // namespace assay
