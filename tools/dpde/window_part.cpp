// SPDX-License-Identifier: Apache-2.0
#include "window_part.h"

#include <fmt/format.h>

#include "dpde/runtime/bytes.h"
#include "driver/report/restart_file.h"
#include "files/files.h"

namespace dpde::tools {

WindowPart::WindowPart(const std::filesystem::path& file, std::uint64_t key, const training::Window& window)
    : path_(fmt::format("{}.{}.{}", file.string(), window.run, window.frame)),
      key_(static_cast<std::int64_t>(key)),
      window_(window) {}

bool WindowPart::save(const training::FoundControls& found, DiagnosticSink& sink) const {
  ByteWriter out;
  out.number(key_);
  out.number(window_.run);
  out.number(window_.frame);
  out.text(found.why);
  out.values(found.losses);
  out.values({found.norm});
  out.number(static_cast<std::int64_t>(found.states.size()));
  for (const std::vector<double>& state : found.states) out.values(state);
  return files::write_file(path_, driver::sealed(out.bytes()), sink);
}

std::optional<training::FoundControls> WindowPart::load() const {
  DiagnosticSink silent;
  std::error_code error;
  if (!std::filesystem::exists(path_, error)) return std::nullopt;
  const std::optional<std::string> bytes = files::read_file(path_, {}, silent);
  const std::optional<std::string_view> content = bytes ? driver::unsealed(*bytes) : std::nullopt;
  if (!content) return std::nullopt;
  ByteReader in(*content);
  if (in.number() != key_ || in.number() != window_.run || in.number() != window_.frame) return std::nullopt;
  training::FoundControls found;
  found.window = window_;
  found.why = in.text();
  found.losses = in.values();
  const std::vector<double> norm = in.values();
  if (norm.size() != 1) return std::nullopt;
  found.norm = norm[0];
  for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) found.states.push_back(in.values());
  return in.is_done() ? std::optional(std::move(found)) : std::nullopt;
}

void WindowPart::remove() const {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

}  // namespace dpde::tools
