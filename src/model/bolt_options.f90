! SPDX-License-Identifier: MIT
!> Rows of the table of options for bolts: &bolt.
module rockdda_model_bolt_options
   use rockdda_base_kinds, only : wp
   use rockdda_model_options, only : bolt_type
   use rockdda_model_option, only : option
   use rockdda_model_option_rows, only : option_rows_type
   implicit none
   private
   public :: describe_bolts

contains

   !> &bolt
   subroutine describe_bolts(table, bolts)
      type(option_rows_type), intent(inout) :: table
      type(bolt_type), allocatable, intent(inout) :: bolts(:)
      integer :: i, n
      if (.not. allocated(bolts)) allocate (bolts(0))
      n = size(bolts)
      call table%begin_list('bolt', 'A bolt: a spring between two blocks along the line of its ends, in tension '// &
                            'and compression. Those of the geometry file come first.', n)
      if (n /= size(bolts)) then
         deallocate (bolts)
         allocate (bolts(n))
      end if
      do i = 1, n
         call table%start_element(i, bolts(i)%origin)
         call describe_bolt(table, bolts(i))
      end do
   end subroutine describe_bolts

   !> One group.
   subroutine describe_bolt(table, bolt)
      type(option_rows_type), intent(inout) :: table
      type(bolt_type), intent(inout) :: bolt
      call table%add(option('name', 'name of the bolt', default_text='none'), bolt%name)
      call table%add_reals(option('from', 'one end, in a block', unit='length', columns='x, y', required=.true.), &
                           bolt%from)
      call table%add_reals(option('to', 'the other end, in another block', unit='length', columns='x, y', &
                                  required=.true.), bolt%to)
      call table%add(option('stiffness', 'force over change of length', unit='force/length', above=0.0_wp, &
                            required=.true.), bolt%stiffness)
      call table%add(option('pretension', 'force at the start, tension positive', unit='force'), bolt%pretension)
      call table%add(option('yield_force', 'force at which the bolt yields, in tension and compression', unit='force', &
                            above=0.0_wp, default_text='none: it does not yield'), bolt%yield_force)
   end subroutine describe_bolt

end module rockdda_model_bolt_options
