// SPDX-License-Identifier: Apache-2.0
// The registry: everything the compiler and the command may ever complain about. One row a kind.
// E01xx characters, E02xx syntax, E03xx names and types, E04xx grid, boundary and time, E05xx schemes,
// E06xx derivatives, E07xx tasks and data, E08xx runs, E09xx files and machine, W0xxx warnings.
// Messages: lower case, one sentence, no stop, the user's words. tests/diagnostics triggers every row.
#pragma once

#include <string_view>

namespace dpde {

enum class Severity { warning, error };

struct DiagnosticKind {
  std::string_view code;
  std::string_view name;
  Severity severity;
  std::string_view message;
};

inline constexpr DiagnosticKind diagnostic_kinds[] = {
    {"E0101", "unexpected-character", Severity::error, "unexpected character {}"},
    {"E0102", "unterminated-text", Severity::error, "text without a closing quote"},
    {"E0103", "bad-number", Severity::error, "number {} is out of range"},
    {"E0104", "file-too-large", Severity::error, "the file has {} bytes, more than the 4194304 that are read"},
    {"E0201", "unexpected", Severity::error, "expected {} but found {}"},
    {"E0202", "unknown-declaration", Severity::error, "{} does not begin a block"},
    {"E0203", "unknown-item", Severity::error, "{} is not understood in a {}"},
    {"E0204", "nesting-too-deep", Severity::error, "the expression has too many parts inside one another"},
    {"E0205", "unclosed-block", Severity::error, "the {} has no closing }"},
    {"E0206", "chained-comparison", Severity::error, "comparisons cannot follow one another"},
    {"E0207", "unknown-option", Severity::error, "{} is not an option of {}"},
    {"E0208", "not-whole", Severity::error, "expected a whole number but found {}"},
    {"E0209", "not-an-equation", Severity::error, "an equation begins with dt(field), not with {}"},
    {"E0210", "bad-role", Severity::error, "{} can stand only before a {}"},
    {"E0211", "repeated", Severity::error, "{} is written twice"},
    {"E0350", "kernel-unknown-name", Severity::error, "{} is not a parameter or let of kernel {}"},
    {"E0351", "kernel-unknown-function", Severity::error, "{} is not a function that kernels can call"},
    {"E0352", "kernel-argument-count", Severity::error, "{} takes {} arguments, not {}"},
    {"E0353", "kernel-offset-count", Severity::error, "{} has {} offsets, but kernel {} has {} axes"},
    {"E0354", "kernel-wrong-role", Severity::error, "{} is a {} and cannot be used as a {}"},
    {"E0355", "kernel-race", Severity::error, "kernel {} writes {}, which it also reads"},
    {"E0356", "kernel-not-written", Severity::error, "{} is declared {} but kernel {} does not write it"},
    {"E0357", "kernel-wrong-assignment", Severity::error, "{} is a {} and is written with {}"},
    {"E0358", "kernel-halo-too-small", Severity::error, "{} is read {} cells away, but its halo is {}"},
    {"E0359", "name-taken", Severity::error, "{} is already the name of {}"},
    {"E0360", "not-in-kernels", Severity::error, "{} cannot stand in a kernel or program"},
    {"E0361", "unknown-kernel", Severity::error, "there is no kernel {}"},
    {"E0362", "unknown-program", Severity::error, "there is no program {}"},
    {"E0363", "program-unknown-field", Severity::error, "no kernel that program {} runs has a field {}"},
    {"E0364", "program-result-not-written", Severity::error, "program {} does not write {}"},
    {"E0365", "program-axes", Severity::error, "program {} has {}, but {} has {}"},
    {"E0366", "fill-incomplete", Severity::error, "the {} of {} says nothing about {}"},
    {"E0367", "boundary-value-varies", Severity::error, "{} is a field, but the values of a {} are made of params and numbers"},
    {"E0368", "bad-program", Severity::error, "{}"},
    {"E0369", "program-without-result", Severity::error, "program {} has no result"},
    {"E0551", "derivative-order", Severity::error, "a derivative of order {} is not one of order 1 to {}"},
    {"E0552", "difference-order", Severity::error, "{} has no central differences of order {}"},
    {"E0553", "advection-form", Severity::error, "semi-Lagrangian advection of {} needs one term -advect(v, {}) of its equation"},
    {"E0554", "not-linear-in-reductions", Severity::error, "this number is not a sum of mean, sum or integral with constant factors"},
    {"E0801", "blow-up", Severity::error, "{} is no longer finite after step {} of {} (t = {}), first in cell ({}) at {}"},
    {"E0802", "interrupted", Severity::error, "stopped after step {} of {} (t = {})"},
    {"E0803", "loss-not-finite", Severity::error, "the loss is {} at iteration {}"},
    {"E0804", "verification-failed", Severity::error, "derivative of {} not certified: {}"},
    {"E0805", "start-not-finite", Severity::error, "the initial state of {} is not finite in cell ({}) at {}"},
    {"E0806", "optimiser-interrupted", Severity::error, "stopped after iteration {} of {}"},
    {"E0807", "run-failed", Severity::error, "{}"},
    {"E0901", "cannot-read", Severity::error, "cannot read {}: {}"},
    {"E0902", "cannot-write", Severity::error, "cannot write {}: {}"},
    {"E0903", "machine-failed", Severity::error, "{}"},
    {"E0904", "bad-option", Severity::error, "{}"},
    {"E0905", "wrong-shape", Severity::error, "{} holds values of shape {}, but {} needs {}"},
    {"E0906", "data-not-finite", Severity::error, "{} holds {} at index {}"},
    {"E0907", "bad-array-file", Severity::error, "{} cannot be used: {}"},
    {"E0908", "nothing-to-do", Severity::error, "{}"},
    {"E0909", "data-of-other-scene", Severity::error, "cannot compare with scene {}: {}"},
    {"E0910", "broken-invariant", Severity::error, "the {} level is broken: {} (this is a bug of dpde)"},
    {"E0911", "broken-program", Severity::error, "the hand-written program cannot be run: {}"},
    {"E0912", "data-without-time", Severity::error, "{} holds no state at t = {}"},
    {"E0913", "unknown-in-coefficient", Severity::error, "unknown {} appears in the formula of coefficient {}"},
    {"E0601", "no-useful-derivative", Severity::error, "{} in kernel {} has no derivative that is of use"},
    {"E0602", "accumulates-onto-read-field", Severity::error, "kernel {} reads field {} and adds to it"},
    {"E0603", "overwritten-value", Severity::error, "the derivative of kernel {} needs field {} as it was before it is changed again"},
    {"E0604", "varied-boundary-value", Severity::error, "a boundary value of field {} depends on an unknown"},
};

/// The row called `name`; a name that is not in the table does not compile.
consteval const DiagnosticKind* find_kind(std::string_view name) {
  for (const DiagnosticKind& kind : diagnostic_kinds) {
    if (kind.name == name) return &kind;
  }
  throw "no diagnostic kind of this name";
}

}  // namespace dpde
