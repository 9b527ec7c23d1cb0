! SPDX-License-Identifier: MIT
!> Groups of &boundary that say too little, too much or the impossible, in any model.
module rockdda_check_boundaries
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_model_options, only : boundary_type, is_set
   implicit none
   private
   public :: check_boundaries

contains

   !> All groups.
   subroutine check_boundaries(boundaries, messages)
      type(boundary_type), intent(in) :: boundaries(:)
      type(diagnostics_type), intent(inout) :: messages
      integer :: g
      do g = 1, size(boundaries)
         call check_group(boundaries(g), g, messages)
      end do
   end subroutine check_boundaries

   !> One group. What is missing without being named here has been reported by the reader.
   subroutine check_group(group, g, messages)
      type(boundary_type), intent(in) :: group
      integer, intent(in) :: g
      type(diagnostics_type), intent(inout) :: messages
      integer :: k
      if (allocated(group%along)) then
         if (size(group%along, 2) < 2) call fail('along: at least two points are needed, found '// &
                                                    to_string(size(group%along, 2)))
         do k = 2, size(group%along, 2)
            if (any(abs(group%along(:, k) - group%along(:, k - 1)) > 0)) cycle
            call fail('along: points '//to_string(k - 1)//' and '//to_string(k)//' are the same')
            exit
         end do
      end if
      if (.not. allocated(group%kind)) return
      if (group%kind == 'moving') then
         if (.not. allocated(group%velocity)) call fail("kind 'moving' needs velocity")
      else if (allocated(group%velocity)) then
         call fail("velocity belongs to kind 'moving'")
      end if
      k = count([allocated(group%stress), allocated(group%traction), is_set(group%pressure)])
      if (group%kind == 'traction') then
         if (k == 0) call fail("kind 'traction' needs one of stress, traction, pressure")
         if (k > 1) call fail('give one of stress, traction, pressure, not several')
      else if (k > 0) then
         call fail("stress, traction and pressure belong to kind 'traction'")
      end if
      if (allocated(group%table) .and. any(group%kind == ['fixed     ', 'roller    ', 'viscous   ', 'free_field'])) &
         call fail("table belongs to kinds 'moving' and 'traction'")
      if (allocated(group%velocity)) call demand_one('velocity: ', size(group%velocity), 2)
      if (allocated(group%stress)) call demand_one('stress: ', size(group%stress), 3)
      if (allocated(group%traction)) call demand_one('traction: ', size(group%traction), 2)

   contains

      !> Demand that number of values.
      subroutine demand_one(name, found, expected)
         character(len=*), intent(in) :: name
         integer, intent(in) :: found, expected
         if (found /= expected) call fail(name//'expected '//to_string(expected)//' numbers, found '// &
                                          to_string(found))
      end subroutine demand_one

      !> An error about the group.
      subroutine fail(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, '&boundary '//to_string(g)//': '//text, group%origin)
      end subroutine fail

   end subroutine check_group

end module rockdda_check_boundaries
