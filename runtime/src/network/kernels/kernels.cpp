// SPDX-License-Identifier: Apache-2.0
#include "network/kernels/kernels.h"

#include "dpde/instruction_set.h"
#include "network/kernels/kernel_sets.h"

namespace dpde::nn {
namespace {

struct Both {
  Kernels<float> single;
  Kernels<double> full;
};

Both choose() {
  Both chosen;
#if defined(__x86_64__)
  switch (instruction_set()) {
    case InstructionSet::v4: kernels_v4(chosen.single, chosen.full); return chosen;
    case InstructionSet::v3: kernels_v3(chosen.single, chosen.full); return chosen;
    case InstructionSet::portable: break;
  }
#endif
  kernels_portable(chosen.single, chosen.full);
  return chosen;
}

const Both& both() {
  static const Both chosen = choose();
  return chosen;
}

}  // namespace

template <>
const Kernels<float>& kernels<float>() {
  return both().single;
}
template <>
const Kernels<double>& kernels<double>() {
  return both().full;
}

}  // namespace dpde::nn
