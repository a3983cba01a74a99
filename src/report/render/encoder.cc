#include "report/render/encoder.h"

#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <string_view>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <spawn.h>

#include "base/errors.h"
#include "isolate/child.h"

extern char** environ;  // NOLINT(*-redundant-declaration): POSIX has the program declare it

namespace assay {
namespace {

// Writing to a process that has ended returns an error instead of ending the program by SIGPIPE.
class NoSigpipe {
 public:
  NoSigpipe() {
    struct sigaction ignore{};
    ignore.sa_handler = SIG_IGN;
    ::sigaction(SIGPIPE, &ignore, &before_);
  }
  ~NoSigpipe() { ::sigaction(SIGPIPE, &before_, nullptr); }
  NoSigpipe(const NoSigpipe&) = delete;
  NoSigpipe& operator=(const NoSigpipe&) = delete;

 private:
  struct sigaction before_{};
};

}  // namespace

Encoder::Encoder(const std::string& path, Format format, int width, int height, double frame_ms) : path_(path) {
  // As a fraction, so that times are exact.
  const std::string rate = fmt::format("1000000/{}", std::llround(1000 * frame_ms));
  const std::string size = fmt::format("{}x{}", width, height);
  // ffmpeg would take a relative name that begins with '-' for an option.
  const std::string file = "file:" + path;
  std::vector<std::string> words = {"ffmpeg",        "-nostdin", "-y",          "-v", "error",      "-f", "rawvideo",
                                    "-pixel_format", "rgb24",    "-video_size", size, "-framerate", rate, "-i",
                                    "pipe:0"};
  const std::vector<std::string> mp4 = {"-c:v",    "libx264",   "-preset",    "medium", "-crf", "20", "-pix_fmt",
                                        "yuv420p", "-movflags", "+faststart", "-f",     "mp4",  file};
  // One palette for all frames and no noise of dithering, so that what rests costs nothing.
  const std::vector<std::string> gif = {
      "-filter_complex",
      "fps='min(source_fps,15)',split[a][b];[a]palettegen[p];[b][p]paletteuse=dither=none:"
      "diff_mode=rectangle",
      "-f", "gif", file};
  const std::vector<std::string>& output = format == Format::kGif ? gif : mp4;
  words.insert(words.end(), output.begin(), output.end());
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  Pipe in = make_pipe(), err = make_pipe();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in.reading.get(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.writing.get(), STDERR_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  // In a process group of its own, so that Ctrl-C reaches assay only and ffmpeg does not finish a file that is removed.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  const int error = ::posix_spawnp(&pid_, "ffmpeg", &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  frames_ = std::move(in.writing);
  words_ = std::move(err.reading);
  if (error == 0) return;
  pid_ = -1;
  throw SystemError(error == ENOENT ? std::string("movies need ffmpeg, which is not on the PATH: install it, as "
                                                  "Debian's package ffmpeg")
                                    : fmt::format("cannot start ffmpeg: {}", strerror(error)));
}

Encoder::~Encoder() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    wait();
  }
}

int Encoder::wait() { return wait_for(std::exchange(pid_, -1)); }

void Encoder::fail() {
  frames_.close();
  std::string said = read_to_end(words_.get());
  while (!said.empty() && (said.back() == '\n' || said.back() == '.')) said.pop_back();
  said = said.substr(said.rfind('\n') + 1);
  throw SystemError(fmt::format("ffmpeg could not write '{}': {}", path_, said.empty() ? "it gave no reason" : said));
}

void Encoder::write(const Picture& picture) {
  const NoSigpipe ignored;
  if (!write_all(frames_.get(), picture.rgb.data(), picture.rgb.size())) fail();
}

void Encoder::finish() {
  frames_.close();
  const int status = wait();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) fail();
}

}  // namespace assay
