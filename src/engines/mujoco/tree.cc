#include "tree.h"

#include <cstddef>
#include <utility>

namespace assay::mujoco {
namespace {

constexpr int kMostFreedoms = 6;  // in one body of MuJoCo's

}  // namespace

Tree share_bodies(const Model& model) {
  const size_t count = model.bodies.size();
  std::vector<int> children(count, 0), only_child(count, -1);
  for (size_t i = 0; i < count; ++i) {
    if (const int parent = model.bodies[i].parent; parent != kWorld) {
      ++children[parent];
      only_child[parent] = static_cast<int>(i);
    }
  }
  std::vector<bool> has_end(count, false);
  const auto mark = [&has_end](int body) {
    if (body != kWorld) has_end[body] = true;
  };
  for (const Connect& connect : model.connects) {
    mark(connect.body_a);
    mark(connect.body_b);
  }
  for (const Weld& weld : model.welds) {
    mark(weld.body_a);
    mark(weld.body_b);
  }

  Tree tree;
  tree.carrier.resize(count);
  tree.X_BC.resize(count);
  tree.parent.assign(count, kWorld);
  tree.X_PC.resize(count);
  std::vector<int> freedoms(count, 0);  // of each carrier's joints so far
  std::vector<bool> turns(count, false);
  std::vector<int> head(count);                             // the first body of each carrier's chain
  for (int i = static_cast<int>(count) - 1; i >= 0; --i) {  // a chain's end first
    const Body& body = model.bodies[i];
    const bool is_ball = body.ball >= 0;
    const int own = is_ball ? 3 : 1;
    int carrier = i;
    if (body.is_massless() && !body.is_free() && children[i] == 1 && !has_end[i]) {
      const int next = tree.carrier[only_child[i]];
      if (freedoms[next] + own <= kMostFreedoms && !(is_ball && turns[next])) carrier = next;
    }
    tree.carrier[i] = carrier;
    if (carrier != i) tree.X_BC[i] = model.bodies[only_child[i]].X_PB * tree.X_BC[only_child[i]];
    head[carrier] = i;
    freedoms[carrier] += own;
    turns[carrier] = turns[carrier] || is_ball || (body.joint >= 0 && !model.joints[body.joint].is_slide());
  }
  for (size_t i = 0; i < count; ++i) {
    if (!tree.is_carrier(static_cast<int>(i))) continue;
    const Body& first = model.bodies[head[i]];
    tree.parent[i] = first.parent;
    tree.X_PC[i] = std::cmp_equal(head[i], i) ? first.X_PB : first.X_PB * tree.X_BC[head[i]];
  }
  return tree;
}

}  // namespace assay::mujoco
