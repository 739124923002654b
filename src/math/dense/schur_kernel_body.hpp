#pragma once

// Compiled once for each instruction set; see kernels_wide.cpp.

#include "math/dense/hessenberg_eigenvalues.hpp"
#include "math/dense/real_schur.hpp"
#include "math/dense/schur_kernel.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

bool schur_form(int n, double* H, double* U, double* work) {
  const int ld = schur_rows(n);
  hessenberg(n, ld, H, U, work);
  return real_schur(n, ld, H, U);
}

bool schur_values(int n, double* H, double* work, std::complex<double>* lambda) {
  const int ld = schur_rows(n);
  hessenberg(n, ld, H, nullptr, work);
  return hessenberg_eigenvalues(n, ld, H, lambda);
}

}  // namespace flyball::detail::FLYBALL_VARIANT
