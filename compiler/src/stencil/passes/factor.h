// SPDX-License-Identifier: Apache-2.0
// Greedy factoring of sums of products by the largest saving of instructions, after Hosangadi, Fallah, Kastner,
// "Optimizing polynomial expressions by algebraic factorization and common subexpression elimination" (2006).
#pragma once

#include <map>
#include <vector>

#include "stencil/passes/polynomial.h"

namespace dpde::stencil {

/// Sums with names for what they share: definitions[k] is what atom k stands for.
struct Factored {
  std::vector<Polynomial> sums;
  std::map<int, Polynomial> definitions;
};

/// What is taken out first: the largest saving, or the largest saving among sums that occur in more than one place.
enum class First { largest, shared };

/// Takes out what several terms of `sums`, or of the atoms defined in them, share, until nothing saves an instruction.
Factored factor(const std::vector<Polynomial>& sums, Atoms& atoms, First first);

/// True for 1 and -1.
bool is_sign(const Coefficient& c);
/// Factors of the monomial, repeated ones counted.
int degree(const Powers& monomial);

}  // namespace dpde::stencil
