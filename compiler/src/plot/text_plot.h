// SPDX-License-Identifier: Apache-2.0
// Draws curves with characters, for terminals.
#pragma once

#include <string>
#include <vector>

#include "plot/picture.h"

namespace dpde::plot {

/// The curves of a panel in one frame of about `width` by `height` characters; the first with dots, the second with
/// small circles. `unicode`: braille dots (2 x 4 for each character), otherwise * and o.
std::string text_plot(const LinePanel& panel, bool unicode, int width = 64, int height = 14);

/// Whether this process's locale prints UTF-8.
bool terminal_is_utf8();

}  // namespace dpde::plot
