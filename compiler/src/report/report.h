// SPDX-License-Identifier: Apache-2.0
// A report: text for people, with its tables and pictures, and JSON for programs. The caller decides on its output: the
// command prints text and writes files.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "plot/picture.h"
#include "support/json.h"

namespace dpde::report {

/// A text file, by full name.
struct TextFile {
  std::string name, text;
};
/// NAME.svg and NAME.png.
struct Picture {
  std::string name;
  std::vector<plot::Panel> panels;
};

/// Text for those who ask for all of it (`check --all`).
struct Detail {
  std::string text;
};

struct Report {
  /// In the order of output.
  std::vector<std::variant<std::string, Detail, TextFile, Picture>> parts;
  Json json = Json::object();

  void say(std::string words) { parts.emplace_back(std::move(words)); }
  void add_detail(std::string words) { parts.emplace_back(Detail{std::move(words)}); }
  void add(std::string name, std::string text) { parts.emplace_back(TextFile{std::move(name), std::move(text)}); }
  /// Adds a picture unless no curve has a finite value.
  void add_if_drawn(std::string name, const plot::LinePanel& panel);
  /// Appends the parts of `other`, and adds the keys of its JSON.
  void append(Report other);
  /// The text parts only, with all details.
  std::string text() const;
};

}  // namespace dpde::report
