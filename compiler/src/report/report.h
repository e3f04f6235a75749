// SPDX-License-Identifier: Apache-2.0
// What is said of something: words for people, with the tables and pictures that belong to them, and JSON for programs.
// Where it goes is the affair of who asked: the command prints words and writes files, a host may do as it likes.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "plot/picture.h"
#include "support/json.h"

namespace dpde::report {

/// A text file, by its whole name.
struct TextFile {
  std::string name, text;
};
/// NAME.svg and NAME.png.
struct Picture {
  std::string name;
  std::vector<plot::Panel> panels;
};

struct Report {
  /// In the order in which they are told.
  std::vector<std::variant<std::string, TextFile, Picture>> parts;
  Json json = Json::object();

  void say(std::string words) { parts.emplace_back(std::move(words)); }
  void add(std::string name, std::string text) { parts.emplace_back(TextFile{std::move(name), std::move(text)}); }
  /// Nothing where no curve has a finite value.
  void add_if_drawn(std::string name, const plot::LinePanel& panel);
  /// What `other` says behind it, and the keys of its JSON.
  void append(Report other);
  /// The words alone.
  std::string text() const;
};

}  // namespace dpde::report
