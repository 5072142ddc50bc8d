#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace berth {

/// Row-major N × N. Small symmetric matrices in doubles, in a fixed order of + − × ÷ √: the same bits everywhere, which
/// a library that chooses its order by the machine's vectors does not promise.
template <std::size_t N>
using SquareMatrix = std::array<double, N * N>;

/// Lower triangle L of a = L Lᵀ in place of a's lower triangle (Cholesky), of the leading `count` unknowns. False where
/// that is not positive definite: where a pivot is left with less than this share of its diagonal element.
template <std::size_t N>
bool factorise(SquareMatrix<N>& a, double least_share = 1e-14, std::size_t count = N) {
  for (std::size_t j = 0; j < count; ++j) {
    double d = a[j * N + j];
    const double whole = d;
    for (std::size_t k = 0; k < j; ++k) d -= a[j * N + k] * a[j * N + k];
    if (!(d > least_share * whole)) return false;
    const double root = std::sqrt(d);
    a[j * N + j] = root;
    for (std::size_t i = j + 1; i < count; ++i) {
      double v = a[i * N + j];
      for (std::size_t k = 0; k < j; ++k) v -= a[i * N + k] * a[j * N + k];
      a[i * N + j] = v / root;
    }
  }
  return true;
}

/// x of L Lᵀ x = b, of the leading `count` unknowns; the others stay b.
template <std::size_t N>
std::array<double, N> solve(const SquareMatrix<N>& factor, std::array<double, N> b, std::size_t count = N) {
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= factor[i * N + k] * b[k];
    b[i] /= factor[i * N + i];
  }
  for (std::size_t i = count; i-- > 0;) {
    for (std::size_t k = i + 1; k < count; ++k) b[i] -= factor[k * N + i] * b[k];
    b[i] /= factor[i * N + i];
  }
  return b;
}

/// The inverse of a symmetric positive definite matrix; false where it is not one. Exactly symmetric.
template <std::size_t N>
bool invert(SquareMatrix<N> a, SquareMatrix<N>& inverse) {
  if (!factorise<N>(a)) return false;
  for (std::size_t j = 0; j < N; ++j) {
    std::array<double, N> unit{};
    unit[j] = 1;
    const std::array<double, N> column = solve<N>(a, unit);
    for (std::size_t i = j; i < N; ++i) inverse[i * N + j] = inverse[j * N + i] = column[i];
  }
  return true;
}

template <std::size_t N>
SquareMatrix<N> multiply(const SquareMatrix<N>& a, const SquareMatrix<N>& b) {
  SquareMatrix<N> c{};
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < N; ++j) {
      for (std::size_t k = 0; k < N; ++k) c[i * N + j] += a[i * N + k] * b[k * N + j];
    }
  }
  return c;
}

template <std::size_t N>
std::array<double, N> multiply(const SquareMatrix<N>& a, const std::array<double, N>& x) {
  std::array<double, N> y{};
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t k = 0; k < N; ++k) y[i] += a[i * N + k] * x[k];
  }
  return y;
}

template <std::size_t N>
SquareMatrix<N> transposed(const SquareMatrix<N>& a) {
  SquareMatrix<N> t{};
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t j = 0; j < N; ++j) t[i * N + j] = a[j * N + i];
  }
  return t;
}

/// xᵀ a x.
template <std::size_t N>
double quadratic(const SquareMatrix<N>& a, const std::array<double, N>& x) {
  const std::array<double, N> y = multiply<N>(a, x);
  double sum = 0;
  for (std::size_t i = 0; i < N; ++i) sum += x[i] * y[i];
  return sum;
}

}  // namespace berth
