// States as CSV, the same for a run and for an export: a row per body and sample, 17 significant digits.
#pragma once

#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "model/state.h"

namespace assay {

inline constexpr std::string_view kStateHeader = "time,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n";

// `names` are the bodies' as fields of a CSV file.
inline void append_state_rows(const std::vector<std::string>& names, double time, const State& state,
                              fmt::memory_buffer& text) {
  for (size_t i = 0; i < names.size(); ++i) {
    const BodyState& body = state.bodies[i];
    fmt::format_to(std::back_inserter(text), "{:.17g},{}", time, names[i]);
    for (const double number :
         {body.p_WBcm.x(), body.p_WBcm.y(), body.p_WBcm.z(), body.q_WB.w(), body.q_WB.x(), body.q_WB.y(), body.q_WB.z(),
          body.v_WBcm.x(), body.v_WBcm.y(), body.v_WBcm.z(), body.w_WB.x(), body.w_WB.y(), body.w_WB.z()}) {
      fmt::format_to(std::back_inserter(text), ",{:.17g}", number);
    }
    text.push_back('\n');
  }
}

}  // namespace assay
