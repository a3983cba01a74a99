// Campaigns, and the messages that go to workers and come from them.
#include <cstdlib>
#include <string>

#include "base/errors.h"
#include "campaign/campaign.h"
#include "campaign/plan.h"
#include "run/messages/messages.h"
#include "targets.h"

namespace assay::fuzz {

void read_campaign(std::string_view bytes) {
  static const std::string model = write_file(
      "ball.xml",
      R"(<mujoco model="ball"><worldbody><body name="ball" pos="0 0 1"><joint name="rail" type="slide"/><geom size=".1"/>
      </body><body name="hand"><freejoint/><geom size=".1"/></body></worldbody></mujoco>)");
  try {
    const Campaign campaign = parse_campaign(std::string(bytes), scratch() + "/campaign.toml");
    static_cast<void>(campaign.hash());
  } catch (const InputError&) {  // NOLINT(bugprone-empty-catch): a refusal
  }
}

void read_messages(std::string_view bytes) {
  try {
    const Request request = parse_request(bytes);
    if (to_line(parse_request(to_line(request))) != to_line(request)) std::abort();
  } catch (const MessageError&) {  // NOLINT(bugprone-empty-catch)
  }
  try {
    const Reply reply = parse_reply(bytes);
    if (to_line(parse_reply(to_line(reply))) != to_line(reply)) std::abort();
  } catch (const MessageError&) {  // NOLINT(bugprone-empty-catch)
  }
}

}  // namespace assay::fuzz
