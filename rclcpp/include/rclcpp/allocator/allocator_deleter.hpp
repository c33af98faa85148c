// Deleters for messages that a program allocates with an allocator of its own.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__ALLOCATOR__ALLOCATOR_DELETER_HPP_
#define RCLCPP__ALLOCATOR__ALLOCATOR_DELETER_HPP_

#include <memory>
#include <stdexcept>
#include <type_traits>

namespace rclcpp::allocator {

/// Thread safety: a value. Real-time: as the allocator.
template <class Allocator>
class AllocatorDeleter {
 public:
  AllocatorDeleter() = default;
  explicit AllocatorDeleter(Allocator* allocator) : allocator_(allocator) {}

  template <class T>
  void operator()(T* object) {
    using Traits = typename std::allocator_traits<Allocator>::template rebind_traits<T>;
    typename Traits::allocator_type allocator(*allocator_);
    Traits::destroy(allocator, object);
    Traits::deallocate(allocator, object, 1);
  }
  Allocator* get_allocator() const { return allocator_; }
  void set_allocator(Allocator* allocator) { allocator_ = allocator; }

 private:
  Allocator* allocator_ = nullptr;
};

template <class T, class U>
void set_allocator_for_deleter(std::default_delete<T>*, std::allocator<U>*) {
}
template <class Allocator>
void set_allocator_for_deleter(AllocatorDeleter<Allocator>* deleter, Allocator* allocator) {
  if (deleter == nullptr || allocator == nullptr) {
    throw std::invalid_argument("Argument was NULL to set_allocator_for_deleter");
  }
  deleter->set_allocator(allocator);
}

template <class Allocator, class T>
using Deleter = std::conditional_t<
    std::is_same_v<typename std::allocator_traits<Allocator>::template rebind_alloc<T>,
                   std::allocator<T>>,
    std::default_delete<T>, AllocatorDeleter<Allocator>>;

}  // namespace rclcpp::allocator

#endif  // RCLCPP__ALLOCATOR__ALLOCATOR_DELETER_HPP_
