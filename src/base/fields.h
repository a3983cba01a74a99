// What lists of a struct's fields share: each list has one row for each member, from which all that reads or writes the
// struct follows.
#pragma once

#include <concepts>
#include <cstddef>
#include <type_traits>

namespace assay {

// The number of members of an aggregate whose members can all be made from Anything, which excludes std::optional.
struct Anything {
  template <typename T>
  operator T() const;  // NOLINT(google-explicit-constructor)
};
template <typename T, typename... Members>
consteval std::size_t member_count() {
  if constexpr (requires { T{Members{}..., Anything{}}; }) {
    return member_count<T, Members..., Anything>();
  } else {
    return sizeof...(Members);
  }
}

// T, or const T: a list of fields is for reading and for writing.
template <typename T, typename U>
concept Of = std::same_as<std::remove_const_t<T>, U>;

// One function object of several, for std::visit.
template <typename... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};

}  // namespace assay
