// SPDX-License-Identifier: Apache-2.0
#include "bare_transform.h"

namespace dpde {

std::unique_ptr<BareTransform> bare_transform(std::int64_t, int, bool) { return nullptr; }

}  // namespace dpde
