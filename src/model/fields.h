// The members of a model's parts, each once. The hash (model.cc) and the JSON for adapters in Python
// (engines/python-host/model_json.cc) follow from these lists. A list is called with a visitor:
//
//   is(name, member)                   the hash has it
//   is.list(count)                     the hash has the next `count` numbers as a list
//   is.later(default, name, member)    the hash has it after all else, and only where it is not the default: a model
//                                      without it keeps the hash that it had before the member existed
//   is.unhashed(name, member)          names of parts, and what is no physics
//
// Hashes are part of stored results, so rows stay where they are. A new member is a later() at the end of its list.
#pragma once

#include "base/fields.h"
#include "model/model.h"

namespace assay {

template <typename Visitor>
void fields(Visitor& is, Of<Body> auto& m) {
  is("name", m.name)("parent", m.parent)("joint", m.joint)("X_PB", m.X_PB)("mass", m.mass)("p_BBcm", m.p_BBcm);
  is("I_BBcm_B", m.I_BBcm_B);
  is.later(-1, "ball", m.ball);
}

template <typename Visitor>
void fields(Visitor& is, Of<Joint> auto& m) {
  is.unhashed("name", m.name);
  is("body", m.body)("p_BJ", m.p_BJ)("axis_B", m.axis_B)("reference", m.reference)("limited", m.limited);
  is.list(6)("lower", m.lower)("upper", m.upper)("stiffness", m.stiffness)("spring_reference", m.spring_reference);
  is("damping", m.damping)("armature", m.armature);
  is.later(JointType::kHinge, "type", m.type);
  is.later(0.0, "dry_friction", m.dry_friction);
}

template <typename Visitor>
void fields(Visitor& is, Of<BallJoint> auto& m) {
  is.unhashed("name", m.name);
  is("body", m.body)("p_BJ", m.p_BJ)("limited", m.limited)("spring_reference", m.spring_reference);
  is.list(5)("upper", m.upper)("stiffness", m.stiffness)("damping", m.damping)("armature", m.armature);
  is("dry_friction", m.dry_friction);
}

template <typename Visitor>
void fields(Visitor& is, Of<Shape> auto& m) {
  is.unhashed("name", m.name);
  is("type", m.type)("body", m.body)("X_BS", m.X_BS);
  is.list(3)("radius", m.radius)("half_length", m.half_length)("friction", m.friction);
  is("collides", m.collides);
  is.unhashed("rgba", m.rgba);
  is.later(Vec3(Vec3::Zero()), "half_size", m.half_size);
  is.later(-1, "data", m.data);
}

template <typename Visitor>
void fields(Visitor& is, Of<Hull> auto& m) {
  is.unhashed("name", m.name);
  is("vertices", m.vertices);
  is.unhashed("faces", m.faces);  // follow from the vertices
}

template <typename Visitor>
void fields(Visitor& is, Of<HeightField> auto& m) {
  is.unhashed("name", m.name);
  is("rows", m.rows)("columns", m.columns);
  is.list(3)("half_x", m.half_x)("half_y", m.half_y)("base", m.base);
  is("heights", m.heights);
}

template <typename Visitor>
void fields(Visitor& is, Of<ContactPair> auto& m) {
  is("shape_a", m.shape_a)("shape_b", m.shape_b)("friction", m.friction);
  is.later(0.0, "torsional", m.torsional, "rolling", m.rolling);
}

template <typename Visitor>
void fields(Visitor& is, Of<JointTerm> auto& m) {
  is("joint", m.joint)("coefficient", m.coefficient);
}

template <typename Visitor>
void fields(Visitor& is, Of<Coupling> auto& m) {
  is.unhashed("name", m.name);
  is("joint", m.joint)("terms", m.terms)("offset", m.offset);
}

template <typename Visitor>
void fields(Visitor& is, Of<Connect> auto& m) {
  is.unhashed("name", m.name);
  is("body_a", m.body_a)("body_b", m.body_b)("p_A", m.p_A)("p_B", m.p_B);
}

template <typename Visitor>
void fields(Visitor& is, Of<Weld> auto& m) {
  is.unhashed("name", m.name);
  is("body_a", m.body_a)("body_b", m.body_b)("X_AB", m.X_AB);
}

template <typename Visitor>
void fields(Visitor& is, Of<Tendon> auto& m) {
  is.unhashed("name", m.name);
  is("terms", m.terms)("limited", m.limited);
  is.list(7)("stiffness", m.stiffness)("rest_lower", m.rest_lower)("rest_upper", m.rest_upper)("damping", m.damping);
  is("lower", m.lower)("upper", m.upper)("dry_friction", m.dry_friction);
}

}  // namespace assay
