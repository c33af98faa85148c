// What a pointer points to, also a smart one.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCPPUTILS__POINTER_TRAITS_HPP_
#define RCPPUTILS__POINTER_TRAITS_HPP_

#include <memory>
#include <type_traits>

namespace rcpputils {

namespace detail {
template <class T>
struct Pointer : std::is_pointer<T> {
  using Pointee = std::remove_pointer_t<T>;
};
template <class T>
struct Pointer<std::shared_ptr<T>> : std::true_type {
  using Pointee = T;
};
template <class T>
struct Pointer<std::unique_ptr<T>> : std::true_type {
  using Pointee = T;
};
}  // namespace detail

/// True for a pointer, a std::shared_ptr, a std::unique_ptr with the default deleter, and
/// references to these.
template <class T>
struct is_pointer : std::bool_constant<detail::Pointer<std::remove_cvref_t<T>>::value> {};

template <class T>
struct remove_pointer {
  using type = typename detail::Pointer<std::remove_cvref_t<T>>::Pointee;
};

}  // namespace rcpputils

#endif  // RCPPUTILS__POINTER_TRAITS_HPP_
