! SPDX-License-Identifier: MIT
!> Hints for mistyped groups and names of namelist files.
module rockdda_io_name_hints
   use rockdda_model_option, only : name_length
   use rockdda_base_suggest, only : did_you_mean
   use rockdda_io_synonyms, only : usual_names
   implicit none
   private
   public :: group_hint, name_hint, other_words

   integer, parameter :: few_names = 6      !! groups of so many names are told with them

contains

   !> The nearest group, as "; did you mean '&time'?", or where else what the name says stands.
   pure function group_hint(group, groups, geometry_words) result(text)
      character(len=*), intent(in) :: group
      character(len=*), intent(in) :: groups(:)     !! valid groups of the file
      character(len=*), intent(in), optional :: geometry_words(:)   !! what the geometry file holds
      character(len=:), allocatable :: text
      character(len=name_length + 1) :: known(size(groups))
      integer :: i
      if (present(geometry_words)) then
         if (any(geometry_words == group)) then
            text = '; lines and points stand in the geometry file'
            return
         end if
      end if
      do i = 1, size(groups)
         known(i) = '&'//groups(i)
      end do
      text = other_words(group, groups)
      if (len(text) > 0) return
      text = did_you_mean('&'//group, known)
   end function group_hint

   !> The other groups that have exactly this name, or else the nearest name of this group; the names of a group that
   !> has few.
   pure function name_hint(name, group, group_of, names) result(text)
      character(len=*), intent(in) :: name, group
      character(len=*), intent(in) :: names(:)      !! all that the file may have
      character(len=*), intent(in) :: group_of(:)   !! the group of each of them
      character(len=:), allocatable :: text
      integer :: i, n_own
      if (name == 'accuracy' .and. group == 'time') then
         text = '; steps are not chosen by their error: rockdda-post convergence shows what the step changes'
         return
      else if (group == 'opening' .and. (name == 'name' .or. name == 'region')) then
         text = "; draw it as &region of the options file, which stages name, and take its outline here: "// &
                "outline = 'NAME'"
         return
      end if
      text = ''
      do i = 1, size(names)
         if (names(i) /= name) cycle
         if (len(text) == 0) then
            text = '; it belongs to &'//trim(group_of(i))
         else if (index(text//' ', '&'//trim(group_of(i))//' ') == 0) then
            text = text//' and &'//trim(group_of(i))
         end if
      end do
      if (len(text) == 0) text = other_words(name, pack(names, group_of == group))
      if (len(text) == 0) text = did_you_mean(name, pack(names, group_of == group))
      n_own = count(group_of == group)
      if (index(text, 'did you mean') > 0 .or. n_own == 0 .or. n_own > few_names) return
      text = text//'; &'//group//' has '
      do i = 1, size(names)
         if (group_of(i) /= group) cycle
         text = text//trim(names(i))
         n_own = n_own - 1
         if (n_own > 0) text = text//', '
      end do
   end function name_hint

   !> "; did you mean 'friction'?" for other words of the field.
   pure function other_words(name, table) result(text)
      character(len=*), intent(in) :: name
      character(len=*), intent(in) :: table(:)      !! names that are known
      character(len=:), allocatable :: text
      character(len=20), allocatable :: usual(:)
      integer :: i
      text = ''
      call usual_names(name, table, usual)
      if (size(usual) == 0) return
      text = "; did you mean '"//trim(usual(1))//"'"
      do i = 2, size(usual)
         text = text//" or '"//trim(usual(i))//"'"
      end do
      text = text//'?'
   end function other_words

end module rockdda_io_name_hints
