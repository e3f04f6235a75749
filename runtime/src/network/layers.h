// SPDX-License-Identifier: Apache-2.0
// Layers that are cheap compared with convolutions: joining channels, pools, upsampling, fixed sums; their rates and
// adjoints.
#pragma once

#include "network/plan.h"
#include "network/view.h"

namespace dpde::nn {

/// Copies (or adds) channels first .. of `from` to those of `to`.
template <class Real>
void copy_channels(const Team& team, const View<Real>& from, int64_t first, const View<Real>& to, int64_t to_first,
                   int64_t count, bool add);

template <class Real>
void clear_cells(const Team& team, const View<Real>& view);

template <class Real>
void mean_pool(const Team& team, int64_t stride, const View<Real>& fine, const View<Real>& coarse);
template <class Real>
void add_mean_pool_adjoint(const Team& team, int64_t stride, const View<Real>& coarse_bar, const View<Real>& fine_bar);

/// The largest of each pool in `fine` selects a cell; `taken` supplies its value: `fine` itself, or its rates.
template <class Real>
void max_pool(const Team& team, int64_t stride, const View<Real>& fine, const View<Real>& taken,
              const View<Real>& coarse);
template <class Real>
void add_max_pool_adjoint(const Team& team, int64_t stride, const View<Real>& fine, const View<Real>& coarse_bar,
                          const View<Real>& fine_bar);

template <class Real>
void upsample(const Team& team, int64_t stride, const View<Real>& coarse, const View<Real>& fine);
template <class Real>
void add_upsample_adjoint(const Team& team, int64_t stride, const View<Real>& fine_bar, const View<Real>& coarse_bar);

/// Also its rate and, since it is symmetric, its adjoint, with a sum of 0.
template <class Real>
void fix_sum(const Team& team, Real sum, const View<Real>& values, const View<Real>& results, bool add);

/// DPDE_REORIENT, also of rates; and its transpose, from the adjoint of the result to (or added to) that of the input.
template <class Real>
void reorient(const Team& team, const Step& step, const View<Real>& input, const View<Real>& result);
template <class Real>
void reorient_back(const Team& team, const Step& step, const View<Real>& result_bar, const View<Real>& input_bar,
                   bool add);

}  // namespace dpde::nn
