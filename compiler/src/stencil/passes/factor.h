// SPDX-License-Identifier: Apache-2.0
// Greedy factoring of sums of products by the largest saving of instructions, after Hosangadi, Fallah, Kastner,
// "Optimizing polynomial expressions by algebraic factorization and common subexpression elimination" (2006).
#pragma once

#include <map>
#include <vector>

#include "stencil/passes/polynomial.h"

namespace dpde::stencil {

/// Sums with atoms for their shared parts: definitions[k] is the polynomial of atom k.
struct Factored {
  std::vector<Polynomial> sums;
  std::map<int, Polynomial> definitions;
};

/// Factored out first: the largest saving, or the largest saving among sums that occur in more than one place.
enum class First { largest, shared };

/// Factors out common parts of terms of `sums`, and of the atoms defined in them, until nothing saves an instruction.
Factored factor(const std::vector<Polynomial>& sums, Atoms& atoms, First first);

/// True for 1 and -1.
bool is_sign(const Coefficient& c);
/// Number of factors of the monomial, with multiplicity.
int degree(const Powers& monomial);

}  // namespace dpde::stencil
