! SPDX-License-Identifier: MIT
!> The group `search` of a results file (docs/file-formats.md, "results").
module rockdda_run_search_group
   use rockdda_base_error, only : error_type
   use rockdda_base_kinds, only : wp
   use rockdda_io_hdf5_adapter, only : hdf5_file_type
   use rockdda_io_results_tables, only : write_units
   use rockdda_run_factor_search, only : factor_search_type
   use rockdda_run_mechanism, only : kind_of
   use rockdda_run_search_options, only : search_names
   use rockdda_run_trial, only : trial_type
   implicit none
   private
   public :: write_search

contains

   !> Write the group `search`.
   subroutine write_search(search, trial, path, error)
      type(factor_search_type), intent(in) :: search
      type(trial_type), intent(in) :: trial      !! that of the file
      character(len=*), intent(in) :: path
      type(error_type), allocatable, intent(out) :: error
      type(hdf5_file_type) :: file
      real(wp) :: low, high
      low = min(search%state%stable, search%state%failing)
      high = max(search%state%stable, search%state%failing)
      call file%open(path, .true., error)
      if (.not. allocated(error)) call file%create_group('search', error)
      if (.not. allocated(error)) call file%set_attribute('search', 'search', &
                                                          trim(search_names(search%options%kind)), error)
      if (.not. allocated(error)) call file%set_attribute('search', 'kind', kind_of(trial%mechanism), error)
      call put_reals('factor', [low + (high - low)/2])
      call put_reals('low', [low])
      call put_reals('high', [high])
      call put_reals('settled_strength', [search%strength])
      call put_reals('value', search%trials%value)
      call put_reals('unbalanced', search%trials%unbalanced)
      call put_reals('displacement', search%trials%displacement)
      call put_reals('seconds', search%trials%seconds)
      call put_integers('stable', merge(1, 0, search%trials%stable))
      call put_integers('steps', search%trials%steps)
      ! segments of linings are no blocks of the results
      associate (m => trial%mechanism, all => search%settled%blocks)
         call put_integers('blocks', pack(m%blocks, m%blocks <= all%n_blocks - all%n_segments) - 1)
         call put_integers('block_kind', pack(m%kinds, m%blocks <= all%n_blocks - all%n_segments))
      end associate
      if (.not. allocated(error)) call write_units(file, search%settled%parameters%units, error, group='search')
      if (allocated(error)) then
         call file%abandon()
      else
         call file%close(error)
      end if

   contains

      !> One dataset.
      subroutine put_reals(name, values)
         character(len=*), intent(in) :: name
         real(wp), intent(in) :: values(:)
         if (.not. allocated(error)) call file%write('search/'//name, [size(values)], values, error)
      end subroutine put_reals

      !> One dataset.
      subroutine put_integers(name, values)
         character(len=*), intent(in) :: name
         integer, intent(in) :: values(:)
         if (.not. allocated(error)) call file%write('search/'//name, [size(values)], values, error)
      end subroutine put_integers

   end subroutine write_search

end module rockdda_run_search_group
