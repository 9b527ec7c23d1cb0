! SPDX-License-Identifier: MIT
!> "Did you mean …": the known name nearest to a mistyped one.
module rockdda_base_suggest
   use rockdda_base_strings, only : lower_case
   implicit none
   private
   public :: nearest_name, did_you_mean, edit_distance

contains

   !> Smallest number of insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`
   !> (optimal string alignment).
   pure integer function edit_distance(a, b)
      character(len=*), intent(in) :: a, b
      integer :: before(0:len(b)), last(0:len(b)), now(0:len(b))
      integer :: i, j, cost
      last = [(j, j=0, len(b))]
      before = last
      do i = 1, len(a)
         now(0) = i
         do j = 1, len(b)
            cost = merge(0, 1, a(i:i) == b(j:j))
            now(j) = min(last(j) + 1, now(j - 1) + 1, last(j - 1) + cost)
            if (i > 1 .and. j > 1) then
               if (a(i:i) == b(j - 1:j - 1) .and. a(i - 1:i - 1) == b(j:j)) &
                  now(j) = min(now(j), before(max(0, j - 2)) + 1)
            end if
         end do
         before = last
         last = now
      end do
      edit_distance = last(len(b))
   end function edit_distance

   !> Index of the known name nearest to `name` (case and trailing blanks aside), 0 when none is near enough:
   !> at most a third of the letters may differ (but at least one or two), or one begins with the other.
   pure integer function nearest_name(name, known)
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: known(:)
      character(len=:), allocatable :: wanted
      integer :: i, d, best, n
      nearest_name = 0
      best = huge(1)
      wanted = trim(lower_case(name))
      if (len(wanted) == 0) return
      do i = 1, size(known)
         n = len_trim(known(i))
         if (n == 0) cycle
         d = edit_distance(wanted, lower_case(known(i)(1:n)))
         if (d > max(2, max(n, len(wanted))/3) .or. d >= max(n, len(wanted))) then
            if (min(n, len(wanted)) < 3) cycle
            if (index(known(i)(1:n), wanted) /= 1 .and. index(wanted, known(i)(1:n)) /= 1) cycle
            d = d + 100
         end if
         if (d < best) then
            best = d
            nearest_name = i
         end if
      end do
   end function nearest_name

   !> "; did you mean 'xxx'?" or empty when no known name is near.
   pure function did_you_mean(name, known) result(text)
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: known(:)
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      i = nearest_name(name, known)
      if (i > 0) text = "; did you mean '"//trim(known(i))//"'?"
   end function did_you_mean

end module rockdda_base_suggest
