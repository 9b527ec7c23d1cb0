! SPDX-License-Identifier: MIT
!> Groups of &water that say too little, too much or the impossible, in any model; and which of them act.
module rockdda_model_water_check
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_options, only : water_type, is_set
   use rockdda_model_regions, only : count_words, same_name, word_of
   implicit none
   private
   public :: check_water, acts, title_of

contains

   !> Does a group act when these are chosen? An empty list: every group does; 'none': no group does.
   pure logical function acts(group, chosen)
      type(water_type), intent(in) :: group
      character(len=*), intent(in) :: chosen     !! names, commas between them
      integer :: k
      acts = len_trim(chosen) == 0
      if (acts .or. same_name(chosen, 'none') .or. .not. allocated(group%name)) return
      do k = 1, count_words(chosen)
         acts = acts .or. same_name(group%name, word_of(chosen, k))
      end do
   end function acts

   !> "&water 1 'lake'"
   pure function title_of(group, g) result(title)
      type(water_type), intent(in) :: group
      integer, intent(in) :: g
      character(len=:), allocatable :: title
      title = '&water '//to_string(g)
      if (.not. allocated(group%name)) return
      if (len_trim(group%name) > 0) title = title//" '"//trim(adjustl(group%name))//"'"
   end function title_of

   !> All groups.
   subroutine check_water(water, messages)
      type(water_type), intent(in) :: water(:)
      type(diagnostics_type), intent(inout) :: messages
      integer :: g
      do g = 1, size(water)
         call check_group(water(g), g, messages)
      end do
   end subroutine check_water

   !> One group.
   subroutine check_group(group, g, messages)
      type(water_type), intent(in) :: group
      integer, intent(in) :: g
      type(diagnostics_type), intent(inout) :: messages
      integer :: k
      if (allocated(group%name)) then
         if (index(group%name, ',') > 0) call fail("name must have no comma, found '"//group%name//"'")
         if (same_name(group%name, 'none')) call fail("name: 'none' means no water")
      end if
      if (allocated(group%table) .eqv. allocated(group%pressure)) &
         call fail('give one of table and pressure_file')
      if (allocated(group%table)) then
         if (size(group%table, 2) == 0) call fail('table: at least one point is needed')
         if (.not. is_set(group%unit_weight)) call fail('table needs the unit_weight of the water')
         do k = 2, size(group%table, 2)
            if (group%table(1, k) > group%table(1, k - 1)) cycle
            call fail('table: x must increase from point to point, but point '//to_string(k)//' has x = '// &
                      to_string(group%table(1, k))//' behind '//to_string(group%table(1, k - 1)))
            exit
         end do
      else if (allocated(group%pressure)) then
         if (allocated(group%level)) call fail('level belongs to table')
         if (is_set(group%unit_weight)) call fail('unit_weight belongs to table')
      end if

   contains

      !> An error about the group.
      subroutine fail(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, title_of(group, g)//': '//text, group%origin)
      end subroutine fail

   end subroutine check_group

end module rockdda_model_water_check
